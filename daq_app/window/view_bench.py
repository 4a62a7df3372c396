"""The view of the bench, whether or not a session runs: transducer, readings, loads, zero and devices. No Qt."""

from dataclasses import asdict, dataclass, replace
from math import isfinite
from typing import Literal

from daq_app.recorder import messages as m
from daq_app.recorder.device_history import Life
from daq_app.window.live_feed import LOADS
from daq_app.window.state import BenchState, Message
from daq_app.wording import COUNT_LABELS, number, quantity, tr, tr_noop
from drivers.calibration_file import AXES
from drivers.transducer import TransducerInfo

HEALTH_NAMES = tr_noop(("zeros", "moved", "noise", "overloads"))
_UNITS = ("N", "N", "N", "N mm", "N mm", "N mm")
COUNTERS = tuple(name for name in COUNT_LABELS if name not in ("received", "off_rate"))  # the rate has its sentence
LAGGING = 100.0  # delay of a reading above which it is reported [ms]
SILENT = 3.0  # time without a report after which the recorder counts as silent [s]
NO_READINGS = 1.0  # time without a reading after which the transducer counts as silent: the span of its rate [s]


def life_rows(info: TransducerInfo | None, life: Life | None) -> tuple[tuple[str, str], ...]:
    """Return a line for each of `HEALTH_NAMES`.

    >>> life = Life(12, "2026-03-02", (0.0412, 0, -0.003, 1.26, 0, 0), (0.0042,) * 3 + (0.052,) * 3, 2, "2026-10-01")
    >>> dict(life_rows(None, life))["moved"], dict(life_rows(None, life))["overloads"]
    ('41 mN, 1.3 N mm since the first', '2, the last on 2026-10-01')
    """
    zeros, drift, noise, overloads = "–", "–", "–", "–" if life is None else tr("none")
    if info is not None and info.simulated:
        zeros = tr("not kept while simulated")
    if life is not None and life.overloads:
        overloads = tr("{count}, the last on {day}", count=life.overloads, day=life.last_overload)
    if life is not None and life.zeros:
        zeros = tr("{count} since {since}", count=life.zeros, since=life.since)
        noise = tr("{noise} usually", noise=greatest(life.noise))
        drift = "–" if life.zeros == 1 else tr("{drift} since the first", drift=greatest(life.drift))
    return tuple(zip(HEALTH_NAMES, (zeros, drift, noise, overloads), strict=True))


def greatest(six: tuple[float, ...]) -> str:
    """Return the text of the greatest force and the greatest torque of six."""
    return f"{_noise(max(map(abs, six[:3])), 'N')}, {_noise(max(map(abs, six[3:])), 'N mm')}"


@dataclass(frozen=True, slots=True)
class Bar:
    """The load of one axis, or of all combined."""

    name: str
    share: float | None  # now; 1 is the rated load; None without a stated range
    peak: float | None  # since it was acknowledged
    overloaded: bool
    noise: str  # standard deviation with its unit; a dash without a measured zero


@dataclass(frozen=True, slots=True)
class BenchView:
    """The displayed data of the bench."""

    lamp: Literal["off", "well", "look", "wrong"]
    lamp_text: str
    name: str
    serial: str
    calibration: str
    rate: str
    silent: bool  # nothing is measured now, or the recorder does not report it
    counters: tuple[tuple[str, str], ...]
    bars: tuple[Bar, ...]
    tare: str  # its figures
    drift: str
    noise: str  # of the zero: the greatest of forces and of torques
    life: tuple[tuple[str, str], ...]  # of its serial number
    devices: tuple[tuple[str, str], ...]  # address and description of each available device
    searching: bool
    search_text: str  # result of the last search; empty before the first
    uri: str
    connect: Message | None  # message of Disconnect or Connect; None while neither is possible
    can_tare: bool
    can_acknowledge: bool


def bench_summary(view: BenchView) -> str:
    """Return the text of the transducer's card: its name, zero, noise and history."""
    if view.lamp == "off":
        return f"{view.name}: {view.lamp_text}."
    zero = tr("Zero: {zero}.", zero=view.tare.rsplit("\n", 1)[-1])
    life = ", ".join(f"{tr(name)} {text}" for name, text in view.life if text != "–") or "–"
    noise = tr("Noise: {noise}.", noise=view.noise)
    return "\n".join((f"{view.name}: {view.lamp_text}.", zero, noise, tr("Life: {life}.", life=life)))


def bench_view(bench: BenchState, *, recording: bool, unheard: float = 0.0) -> BenchView:
    """Return the view of the bench; `recording` keeps it connected, `unheard` is the last report's age [s]."""
    info = bench.info
    if unheard > SILENT:
        bench = replace(bench, silence=bench.silence + unheard)
    lamp, lamp_text = _bench_lamp(bench, recording=recording)
    counts, lag = asdict(bench.health), f"{bench.health.lag_ms:.0f} ms"
    open_now = bench.link == "open"
    return BenchView(
        lamp=lamp,
        lamp_text=lamp_text,
        name=tr("no transducer") if info is None else info.model,
        serial="–" if info is None else info.serial,
        calibration="–" if info is None else info.calibration.source,
        rate=_rate(bench),
        silent=bench.link != "open" or _is_silent(bench),
        counters=(*((COUNT_LABELS[name], f"{counts[name]}") for name in ("received", *COUNTERS)), ("lag", lag)),
        bars=_bars(bench),
        tare=_tare(bench),
        drift=_drift(bench),
        noise=greatest(bench.zero.noise) if bench.zero is not None else "–",
        life=life_rows(info, bench.life),
        devices=_devices(bench),
        searching=bench.searching,
        search_text=_search_text(bench),
        uri=bench.uri,
        connect=m.Disconnect() if bench.link in ("open", "lost") and not recording else None,
        can_tare=open_now and not recording and not bench.taring,
        can_acknowledge=bool(bench.peak.overloads or bench.saturated),
    )


def _search_text(bench: BenchState) -> str:
    if bench.searching:
        return tr("Looking for transducers.")
    if not bench.searched:
        return ""
    if not bench.devices:
        return tr("No transducer answered. Check power and cable, or type an address, such as net-ft://192.168.1.1.")
    return tr("Found {count}: choose from the list.", count=len(bench.devices))


def _bench_lamp(bench: BenchState, *, recording: bool) -> tuple[Literal["off", "well", "look", "wrong"], str]:
    match bench.link:
        case "none":
            return "off", tr("not connected")
        case "connecting":
            return "look", tr("connecting")
        case "lost":
            return "wrong", tr("does not answer")
        case "open":
            pass
    if _is_silent(bench):
        return "wrong" if recording else "look", tr("no readings for {age:.0f} s", age=bench.silence)
    if bench.peak.overloads:
        return "wrong", tr("overloaded")
    if bench.saturated:
        flags = ", ".join(bench.health.flagged)
        return "wrong", tr("invalid readings: {said}", said=flags) if flags else tr("invalid readings")
    if near := bench.peak.near_limits:
        return "look", tr("near the rated load: {axes}", axes=", ".join(tr(axis) for axis in near))
    return _losses(bench)


def _losses(bench: BenchState) -> tuple[Literal["well", "look"], str]:
    """Return the stream's losses in words, and their grade."""
    counts = asdict(bench.health)
    troubles = [f"{counts[name]} {tr(COUNT_LABELS[name])}" for name in COUNTERS if counts[name]]
    rate = [bench.health.rate_words] if bench.health.off_rate else []
    if troubles := [*troubles, *bench.health.flagged, *rate]:
        return "look", ", ".join(troubles)
    if bench.health.lag_ms > LAGGING:
        return "look", tr("{lag:.0f} ms late", lag=bench.health.lag_ms)
    return "well", tr("nothing lost")


def _is_silent(bench: BenchState) -> bool:
    return bench.link == "open" and bench.silence > NO_READINGS


def _rate(bench: BenchState) -> str:
    if bench.info is None:
        return "–"
    rate = quantity(bench.info.rate, 0) if isfinite(bench.info.rate) else tr("unknown")
    measured = quantity(bench.rate, 0) if bench.rate > 0.0 else "–"  # nothing is being measured
    return tr("{measured} Hz (set {asked})", measured=measured, asked=rate)


def _bars(bench: BenchState) -> tuple[Bar, ...]:
    overloads = set(bench.peak.overloads)
    noise = ["–"] * 6 if bench.zero is None else [*map(_noise, bench.zero.noise, _UNITS)]
    rows = zip(LOADS, bench.load.shares, bench.peak.shares, (*noise, ""), strict=True)
    return tuple(Bar(name, _share(now), _share(peak), name in overloads, text) for name, now, peak, text in rows)


def _share(value: float) -> float | None:
    return value if isfinite(value) else None


def _noise(value: float, unit: str) -> str:
    """Return a standard deviation with two digits, in mN or N mm.

    >>> _noise(0.0042, "N"), _noise(0.152, "N"), _noise(0.052, "N mm")
    ('4.2 mN', '152 mN', '0.052 N mm')
    """
    return f"{number(1000 * value, 2)} mN" if unit == "N" else f"{number(value, 2)} {unit}"


def _tare(bench: BenchState) -> str:
    if bench.taring:
        return tr("being measured: hands off")
    if bench.zero is None:
        return tr("not measured")
    zero = bench.zero
    texts = [quantity(1000 * force, 0) for force in zero.mean[:3]] + [quantity(torque, 1) for torque in zero.mean[3:]]
    fx, fy, fz, tx, ty, tz = (f"{axis} {text}" for axis, text in zip(AXES, texts, strict=True))
    return tr(
        "{forces}\n{torques}\nover {duration:.1f} s, n = {readings}",
        forces=f"{fx}, {fy}, {fz} mN", torques=f"{tx}, {ty}, {tz} N mm",
        readings=zero.readings, duration=zero.duration,
    )  # fmt: skip


def _drift(bench: BenchState) -> str:
    if bench.zero is None or bench.first_zero is None:
        return "–"
    if bench.zero is bench.first_zero:
        return tr("first zero")
    drift = max(abs(zero - first) for zero, first in zip(bench.zero.mean[:3], bench.first_zero.mean[:3], strict=True))
    return tr("{moved} since the first", moved=quantity(1000 * drift, 0, "mN"))


def _devices(bench: BenchState) -> tuple[tuple[str, str], ...]:
    rows = [("sim:", tr("Simulated bench"))]
    for device in bench.devices:
        if (info := device.info) is not None:
            detail = tr("serial {serial} · {source}", serial=info.serial, source=info.calibration.source)
            rows.append((device.uri, f"{info.model} · {detail}"))
    return tuple(rows)


def no_readings(bench: BenchState, *, running: bool) -> str:
    """Return why a transducer that should send does not; empty if it does."""
    if bench.link == "lost":
        lost = tr(" Readings are being lost; earlier ones are saved.") if running else ""
        problem = (bench.problem or "").removeprefix("the transducer does not answer; ")  # the banner itself says that
        return tr("The transducer does not answer: {problem}.{lost}", problem=problem, lost=lost)
    if running and _is_silent(bench):
        text = tr("No readings for {age:.0f} s: check power and cable of the transducer.", age=bench.silence)
        return text + tr(" Earlier readings are saved.")
    return ""
