"""What the model says of each trial and of a session, and how that is told as plain data."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, cast

import msgspec

from sessions.json_document import complete, converted
from sessions.plan.plan import Stimulus
from sessions.prediction.options import PredictionOptions, template
from sessions.prediction.sed_interval import Ends, SedInterval
from sessions.prediction.variants import Alternative
from sessions.strokes.contact_area import FIXED, AreaLaw
from sessions.strokes.decisions import Decision
from sessions.toml_file import from_table
from solver import Prediction, Scene
from solver.prediction import History, Response, Skin
from solver.response.fields import Fields, fields_of

_NOT_STORED = ("prediction", "opposite")  # of a row as plain data: all that the solver found
_STORED_OTHERWISE = ("stimulus", "alternatives", "interval", "opposite_interval")

# Options as they were called until 2026-11-26, and what they are called now. Documents hold both names for one release.
_RENAMED = {"beside": "variants", "beside_intervals": "variant_intervals"}
ERROR_NOT_KNOWN = "The error is not known: the nested mesh has no such state."


def known_error(prediction: Prediction, error: float | None) -> float | None:
    """Return a relative error of `found` [-], or None where its nested mesh has no such state to compare with."""
    return None if prediction.nested is None else error


@dataclass(frozen=True, slots=True, eq=False)
class TrialPrediction:
    """What the model says of one trial, or of one stroke of a recording without trials.

    A number is None where `reasons` says why, under the number's name.
    """

    trial: int | None
    stroke: int | None  # position in `Analysis.strokes`; None where the trial has none
    block: str | None
    stimulus: Stimulus | None
    mu: float | None  # that the model got [-]
    mu_rule: str  # which mu that is
    tau_max: float | None  # that the model got [MPa]
    indentation: float | None  # [mm]
    direction: int | None  # +1 proximal to distal, -1 back; as measured, or else as planned
    speed: float | None  # [mm/s]
    sed: float | None  # averaged over the ending [MPa]
    error_estimate: float | None  # relative, of sed
    normal_per_mm: float | None  # [N/mm]
    tangential_per_mm: float | None  # [N/mm]
    normal_force: float | None  # normal_per_mm times the finger's width [N]
    tangential_force: float | None  # [N]
    measured_normal: float | None  # mean over the steady window [N]
    measured_tangential: float | None  # [N]
    matching_depth: float | None  # indentation at which the model's normal force is the measured one [mm]
    opposite_sed: float | None  # at the same depth, slid the other way [MPa]
    wall_s: float | None  # the solve [s]
    reasons: Mapping[str, str]
    prediction: Prediction | None = None  # all that the solver found
    opposite: Prediction | None = None  # that slid the other way
    alternatives: tuple[Alternative, ...] = ()  # the same trial predicted otherwise, where that was asked for
    interval: SedInterval | None = None  # of `sed`, where it was asked for
    opposite_interval: SedInterval | None = None  # of `opposite_sed`
    # Estimated by the solver, relative [-]: None where there is no such number, or nobody solved for its error
    normal_force_error: float | None = None
    tangential_force_error: float | None = None
    opposite_error: float | None = None
    matching_depth_error: float | None = None
    matching_depth_interval: Ends | None = None  # that friction and the measured force make of it [mm]

    @property
    def responses(self) -> Mapping[str, Response]:
        """Return every quantity at the ending by its name; none where there is no prediction."""
        return {} if self.prediction is None else self.prediction.responses

    @property
    def history(self) -> History | None:
        """Return the course in time, where it was asked for."""
        return None if self.prediction is None else self.prediction.history

    def picture(self) -> tuple[Fields, Skin] | None:
        """Return the deformed finger with its SED, and the skin's pressures; None where there is no prediction."""
        return None if self.prediction is None else (fields_of(self.prediction), self.prediction.skin)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        row = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in (*_NOT_STORED, *_STORED_OTHERWISE)}
        row["stimulus"] = None if self.stimulus is None else asdict(self.stimulus)
        row["reasons"] = dict(self.reasons)
        row["alternatives"] = [asdict(one) for one in self.alternatives]
        optional = {"interval": self.interval, "opposite_interval": self.opposite_interval}
        row |= {name: asdict(one) for name, one in optional.items() if one is not None}
        row["solver"] = None if self.prediction is None else self.prediction.to_dict()
        return row


@dataclass(frozen=True, slots=True, eq=False)
class SessionPrediction:
    """What the model says of a session."""

    simulated: bool
    trials: tuple[TrialPrediction, ...]
    width: float  # of the finger [mm]
    width_origin: str  # "set" or "assumed"
    options: PredictionOptions
    decisions: tuple[Decision, ...] = ()  # of people about the strokes, in force
    area: AreaLaw = FIXED  # by which tau_max was told
    gain_error: float | None = None  # of each axis, which the intervals hold [-]; None: the assumed one
    bootstrap_seed: int = 0  # of the intervals

    @property
    def finger(self) -> Scene:
        """The finger that was asked, at the strain that was asked for; its friction and loading mean nothing."""
        finger = template(self.options)
        return replace(finger, solve=replace(finger.solve, kinematics=self.options.kinematics))

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data, None where honesty allows no number."""
        options = asdict(self.options)
        origin = {f.name: "default" if options[f.name] == f.default else "set" for f in fields(self.options)}
        return {
            **({"simulated": "SIMULATED"} if self.simulated else {}),
            "trials": [trial.to_dict() for trial in self.trials],
            "decisions": [decision.to_dict() for decision in self.decisions],
            "area": asdict(self.area),
            "gain_error": self.gain_error,
            "bootstrap_seed": self.bootstrap_seed,
            "width": self.width,
            "width_origin": self.width_origin,
            "options": _with_former_names(options),
            "options_origin": _with_former_names(origin),
            "scene": asdict(template(self.options)),  # finger, materials and settings as used, defaults filled in
        }


class _Solver(msgspec.Struct):
    dofs: int


class _Solved(msgspec.Struct):
    solver: _Solver | None


class _SolvedTrials(msgspec.Struct):
    trials: tuple[_Solved, ...]


class _Document(msgspec.Struct):
    """The parts of `prediction.json` that the program itself reads."""

    made_by: dict[str, str]
    trials: tuple[TrialPrediction, ...]
    width: float
    width_origin: str
    options: dict[str, Any]
    scene: dict[str, Any]
    area: dict[str, Any]
    decisions: tuple[Decision, ...]


def _with_former_names(options: Mapping[str, Any]) -> dict[str, Any]:
    return {**options, **{former: options[name] for former, name in _RENAMED.items()}}


def with_present_names(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a prediction with each of its options called as it is now, and by that name alone."""
    parts = {name: document.get(name) for name in ("options", "options_origin")}
    renamed = {
        name: {_RENAMED.get(key, key): value for key, value in cast("dict[str, Any]", part).items()}
        for name, part in parts.items()
        if isinstance(part, dict)
    }
    return {**document, **renamed}


def check_prediction(document: Mapping[str, Any]) -> None:
    """Raise ValueError where a document is no prediction that this program writes: where, and what is expected."""
    parts = complete(document, _Document)
    converted(document, _SolvedTrials)
    from_table(parts.options, PredictionOptions, "options")
    from_table(parts.scene, Scene, "scene")
