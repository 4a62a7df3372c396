"""What a serial number has been through, as the bench shows it: zeros, how far they moved, its noise, its overloads."""

from daq_app.recorder.device_history import Life
from daq_app.wording import tr, tr_noop
from drivers.transducer import TransducerInfo

NAMES = tr_noop(("zeros", "moved", "noise", "overloads"))


def life_rows(info: TransducerInfo | None, life: Life | None) -> tuple[tuple[str, str], ...]:
    """Return a line for each of `NAMES`.

    >>> life = Life(12, "2026-03-02", (0.0412, 0, -0.003, 1.26, 0, 0), (0.0042,) * 3 + (0.052,) * 3, 2, "2026-10-01")
    >>> dict(life_rows(None, life))["moved"], dict(life_rows(None, life))["overloads"]
    ('41 mN, 1.3 N mm since the first', '2, the last on 2026-10-01')
    """
    if life is None or not life.zeros:
        why = tr("not kept while simulated") if info is not None and info.simulated else "–"
        overloads = "–" if life is None else _overloads(life)
        return tuple(zip(NAMES, (why, "–", "–", overloads), strict=True))
    texts = (
        tr("{count} since {since}", count=life.zeros, since=life.since),
        "–" if life.zeros == 1 else tr("{drift} since the first", drift=greatest(life.drift)),
        tr("{noise} usually", noise=greatest(life.noise)),
        _overloads(life),
    )
    return tuple(zip(NAMES, texts, strict=True))


def _overloads(life: Life) -> str:
    return (
        tr("{count}, the last on {day}", count=life.overloads, day=life.last_overload) if life.overloads else tr("none")
    )


def greatest(six: tuple[float, ...]) -> str:
    """Return the greatest force and the greatest torque of six."""
    force, torque = max(map(abs, six[:3])), max(map(abs, six[3:]))
    return f"{1000 * force:.2g} mN, {torque:.2g} N mm"
