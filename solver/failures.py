"""Failures of a solve, each with one sentence and the limits that are known."""

from typing import Any


class SolveFailure(Exception):
    """A scene without a solution. `kind` identifies the failure for scripts."""

    kind = "failed"

    def __init__(
        self,
        message: str,
        *,
        limit_mu: float | None = None,
        limit_indentation: float | None = None,
        limit_normal_force: float | None = None,
    ) -> None:
        """Store the `message`, which states the load, the cause and the attempts, and the limits that are known.

        `limit_mu` is the largest coefficient of friction at this depth or force, with this bound. `limit_indentation`
        [mm] is the largest depth at this coefficient and bound. `limit_normal_force` [N/mm] is the largest force, where
        one was given.
        """
        super().__init__(message)
        self.limit_mu, self.limit_indentation, self.limit_normal_force = (
            None if limit is None else float(limit) for limit in (limit_mu, limit_indentation, limit_normal_force)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the object that `daq-app solve --json` prints instead of a prediction."""
        return {"error": {"kind": self.kind, **vars(self), "message": str(self)}}

    def in_a_sentence(self) -> "SolveFailure":
        """Return this failure with its message as a sentence; other modules raise fragments.

        >>> str(SolveFailure("no equilibrium within 25 iterations").in_a_sentence())
        'No equilibrium within 25 iterations.'
        """
        message = str(self)
        return type(self)(message[:1].upper() + message[1:] + ("" if message.endswith(".") else "."), **vars(self))


class NoSteadyState(SolveFailure):
    """The finger cannot slide steadily: friction wedges it into the surface faster than it yields."""

    kind = "no_steady_state"


def beyond_friction(drag: float, most: float, normal_force: float) -> NoSteadyState:
    """Return the failure of a prescribed `drag` beyond `most`, the friction limit [N/mm]."""
    return NoSteadyState(
        f"A drag of {drag:.4g} N/mm lies outside the friction limit: pressed with {normal_force:.4g} N/mm, the finger "
        f"slides from {most:.4g} N/mm on; ask for less drag, or leave it out to let the finger slide."
    )


MIXED = "nearly incompressible tissues, or ones whose stiffnesses differ by many orders of magnitude,"


class NotConverged(SolveFailure):
    """The equations have not been solved; it is unknown whether they have a solution."""

    kind = "not_converged"


class Folds(NotConverged):
    """Tissue folds at the free cut, or wrinkles. Finer meshes fold differently, so that no error is known."""


def cut_folds(least: float, folds: float) -> Folds:
    """Return the failure of tissue squeezed to the stretch `least`, where a free face folds at `folds` [-].

    >>> str(cut_folds(0.31, 0.54))[:88]
    'tissue beside the free cut folds (it is squeezed to 31 % of its length, and a free face '
    """
    return Folds(
        f"tissue beside the free cut folds (it is squeezed to {100 * least:.0f} % of its length, and a free face folds "
        f'at {100 * folds:.0f} %): ask for finger.cut = "driven", a longer shaft, or less depth or friction'
    )


WRINKLES = (
    "the tissue is unstable, like a stiff layer that wrinkles on a soft one: ask for less depth or friction, or for "
    "tissues that differ less in stiffness"
)


class ContactLost(NotConverged):
    """No consistent set of contact states was found; the message says what was tried."""


def at_end_of_path(depth: float, travel: float, reason: object) -> NotConverged:
    """Return the failure of a load path that ends at a `depth` and a `travel` [mm], before its target.

    >>> str(at_end_of_path(1.5, -0.2, "no equilibrium"))[:70]
    'the load path was followed to 1.5 mm of indentation and 0.2 mm of slid'
    >>> str(at_end_of_path(-4.754, 0.0, "no equilibrium"))[:78]
    'the load path was followed to where the drag holds the bone 4.754 mm above fir'
    """
    lift = f"where the drag holds the bone {-depth:.4g} mm above first touch"
    position = f"{depth:.4g} mm of indentation" if depth >= 0.0 else lift
    slip = f" and {abs(travel):.4g} mm of sliding" if travel else ""
    return NotConverged(
        f"the load path was followed to {position}{slip}, and the smallest steps failed beyond: {reason}; ask for less "
        "friction, drag or depth."
    )
