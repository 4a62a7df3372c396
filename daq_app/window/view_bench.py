"""The bench as the experimenter sees it: which transducer, whether it is well, how far it is loaded."""

from dataclasses import asdict, dataclass
from math import isfinite
from typing import Literal

from daq_app.recorder import messages as m
from daq_app.recorder.device_history import Life
from daq_app.window.bench_load import AXES
from daq_app.window.bench_state import BenchState
from daq_app.window.messages import Message
from daq_app.wording import tr, tr_noop
from drivers.transducer import TransducerInfo

NAMES = tr_noop(("zeros", "moved", "noise", "overloads"))
UNITS = ("N", "N", "N", "N mm", "N mm", "N mm")
COUNTED = (
    "lost",
    "repeated",
    "late",
    "malformed",
    "stalled",
    "restarted",
    "saturated",
    "doubtful",
    "noted",
    "off_units",
)
LAGGING = 100.0  # a reading handed over later than this is worth a look [ms]


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


@dataclass(frozen=True, slots=True)
class DeviceRow:
    """A transducer that can be connected."""

    uri: str
    name: str
    detail: str


@dataclass(frozen=True, slots=True)
class Bar:
    """How far one axis, or all together, is loaded."""

    name: str
    share: float | None  # now; 1 is the rated load; None where no range is stated
    peak: float | None  # since somebody acknowledged
    over: bool
    noise: str  # standard deviation with its unit; a dash where no zero was measured


@dataclass(frozen=True, slots=True)
class BenchView:
    """Everything about the bench."""

    lamp: Literal["off", "well", "look", "wrong"]
    lamp_words: str
    name: str
    serial: str
    calibration: str
    rate: str
    counters: tuple[tuple[str, str], ...]
    bars: tuple[Bar, ...]
    tare: str  # its figures
    drift: str
    noise: str  # of the zero: that of the loudest force and torque
    life: tuple[tuple[str, str], ...]  # of its serial number
    devices: tuple[DeviceRow, ...]
    searching: bool
    search_words: str  # what a search came to; empty before the first
    uri: str
    connect: Message | None  # what Disconnect or Connect would send; None while neither is possible
    can_tare: bool
    can_acknowledge: bool


def bench_summary(view: BenchView) -> str:
    """Return what the card of the transducer says: which it is, its zero, noise and life.

    One that is not connected has its name alone.
    """
    if view.lamp == "off":
        return f"{view.name}: {view.lamp_words}."
    zero = view.tare.rsplit("\n", 1)[-1]
    life = ", ".join(f"{tr(name)} {text}" for name, text in view.life if text != "–") or "–"
    return "\n".join(
        (
            f"{view.name}: {view.lamp_words}.",
            tr("Zero: {zero}.", zero=zero),
            tr("Noise: {noise}.", noise=view.noise),
            tr("Life: {life}.", life=life),
        )
    )


def bench_view(bench: BenchState, *, recording: bool) -> BenchView:
    """Return what is shown of the bench; while a session is recorded it is neither disconnected nor tared."""
    info = bench.info
    lamp, words = _lamp(bench)
    open_now = bench.link == "open"
    noted = bench.zero is not None
    return BenchView(
        lamp=lamp,
        lamp_words=words,
        name=tr("no transducer") if info is None else info.model,
        serial="–" if info is None else info.serial,
        calibration="–" if info is None else info.calibration.source,
        rate=_rate(bench),
        counters=_counters(bench),
        bars=_bars(bench),
        tare=_tare(bench),
        drift=_drift(bench) if noted else "–",
        noise=greatest(bench.zero.noise) if bench.zero is not None else "–",
        life=life_rows(info, bench.life),
        devices=_devices(bench),
        searching=bench.searching,
        search_words=_search_words(bench),
        uri=bench.uri,
        connect=m.Disconnect() if open_now and not recording else None,
        can_tare=open_now and not recording and not bench.taring,
        can_acknowledge=bool(bench.peak.over or bench.saturated),
    )


def _search_words(bench: BenchState) -> str:
    if bench.searching:
        return tr("Looking for transducers.")
    if not bench.searched:
        return ""
    if not bench.devices:
        return tr("No transducer answered. Check power and cable, or type an address, such as net-ft://192.168.1.1.")
    return tr("Found {count}: choose from the list.", count=len(bench.devices))


def _lamp(bench: BenchState) -> tuple[Literal["off", "well", "look", "wrong"], str]:
    match bench.link:
        case "none":
            return "off", tr("not connected")
        case "connecting":
            return "look", tr("connecting")
        case "lost":
            return "wrong", tr("does not answer")
        case "open":
            pass
    if bench.peak.over:
        return "wrong", tr("overloaded")
    if bench.saturated:
        said = ", ".join(bench.health.flagged)
        return "wrong", tr("invalid readings: {said}", said=said) if said else tr("invalid readings")
    if near := bench.peak.near:
        return "look", tr("near the rated load: {axes}", axes=", ".join(tr(axis) for axis in near))
    counts = asdict(bench.health)
    troubles = [f"{counts[name]} {name}" for name in COUNTED if counts[name]]
    troubles += list(bench.health.flagged)
    troubles += [bench.health.rate_words] if bench.health.off_rate else []
    if troubles:
        return "look", ", ".join(troubles)
    if bench.health.lag_ms > LAGGING:
        return "look", tr("{lag:.0f} ms late", lag=bench.health.lag_ms)
    return "well", tr("nothing lost")


def _rate(bench: BenchState) -> str:
    if bench.info is None:
        return "–"
    rate = f"{bench.info.rate:.0f}" if isfinite(bench.info.rate) else "unknown"
    measured = f"{bench.rate:.0f}" if isfinite(bench.rate) else "–"
    return tr("{measured} Hz (set {asked})", measured=measured, asked=rate)


def _counters(bench: BenchState) -> tuple[tuple[str, str], ...]:
    counts = asdict(bench.health)
    rows = [("received", f"{counts['received']}")]
    rows += [(name, f"{counts[name]}") for name in COUNTED]
    return (*rows, ("lag", f"{bench.health.lag_ms:.0f} ms"))


def _bars(bench: BenchState) -> tuple[Bar, ...]:
    over = set(bench.peak.over)
    noise = ["–"] * 6 if bench.zero is None else [_noise(n, u) for n, u in zip(bench.zero.noise, UNITS, strict=True)]
    rows = zip(AXES, bench.load.axes, bench.peak.axes, noise, strict=True)
    bars = [Bar(name, _share(now), _share(peak), name in over, text) for name, now, peak, text in rows]
    all_together = Bar("combined", _share(bench.load.combined), _share(bench.peak.combined), "combined" in over, "")
    return (*bars, all_together)


def _share(value: float) -> float | None:
    return value if isfinite(value) else None


def _noise(value: float, unit: str) -> str:
    """Return a standard deviation in the smaller unit, two digits.

    >>> _noise(0.0042, "N"), _noise(0.052, "N mm")
    ('4.2 mN', '0.052 N mm')
    """
    return tr("{value:.2g} mN", value=1000 * value) if unit == "N" else f"{value:.2g} {unit}"


def _tare(bench: BenchState) -> str:
    if bench.taring:
        return tr("being measured: hands off")
    if bench.zero is None:
        return tr("not measured")
    zero = bench.zero
    fx, fy, fz, tx, ty, tz = zero.mean
    forces = f"Fx {_mn(fx)}, Fy {_mn(fy)}, Fz {_mn(fz)} mN"
    torques = f"Tx {_nmm(tx)}, Ty {_nmm(ty)}, Tz {_nmm(tz)} N mm"
    return tr(
        "{forces}\n{torques}\nover {duration:.1f} s, n = {readings}",
        forces=forces,
        torques=torques,
        readings=zero.readings,
        duration=zero.duration,
    )


def _drift(bench: BenchState) -> str:
    if bench.zero is None or bench.first_zero is None:
        return "–"
    if bench.zero is bench.first_zero:
        return tr("first zero")
    moved = max(abs(a - b) for a, b in zip(bench.zero.mean[:3], bench.first_zero.mean[:3], strict=True))
    return tr("{moved:.0f} mN since the first", moved=1000 * moved)


def _mn(newtons: float) -> str:
    return f"{round(1000 * newtons) + 0:d}".replace("-", "−")


def _nmm(torque: float) -> str:
    return f"{torque + 0.0:.1f}".replace("-0.0", "0.0").replace("-", "−")


def _devices(bench: BenchState) -> tuple[DeviceRow, ...]:
    rows = [DeviceRow("sim:", tr("Simulated bench"), tr("always there"))]
    for device in bench.devices:
        if device.info is not None:
            info = device.info
            detail = tr("serial {serial} · {source}", serial=info.serial, source=info.calibration.source)
            rows.append(DeviceRow(device.uri, info.model, detail))
    return tuple(rows)
