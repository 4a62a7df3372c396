"""Intervals of a stroke's numbers from sensor noise, zero, calibration and choice of window: a seeded block bootstrap.

Readings within a tenth of a second are correlated, so blocks are resampled, not readings (Künsch 1989, Ann. Statist.
17:1217). Each repeat also draws errors of calibration, tilt of the face and zero, and both ends of the window. The
interval lies between two quantiles of the repeats.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from drivers.arrays import Array, Indices
from sessions.strokes.contacts import onset_draws
from sessions.strokes.settings import BootstrapSettings
from sessions.strokes.sliding import slide_onset_draws
from sessions.strokes.stick import break_away_draws
from sessions.strokes.stroke import Interval, Stroke, StrokeCurve

_OF_SESSION = 2**32 - 1  # in the seed, in place of a stroke's number


class SystematicDraws:
    """Systematic errors of one session, (repeats,) each, shared by all its strokes."""

    def __init__(self, settings: BootstrapSettings) -> None:
        """Draw gains, cross-talk and the tilt of the face's normal towards +x and +y.

        A press shows a sideways force by tilt and by cross-talk: a tilt from presses is their sum. The mean of so few
        presses follows Student's law (JCGM 101:2008, 6.4.9).
        """
        draw, repeats = np.random.default_rng([settings.seed, _OF_SESSION]), settings.repeats
        self.gain_t, self.gain_n, self.gain_torque = 1.0 + settings.gain_error * draw.standard_normal((3, repeats))
        into_drag, into_normal = settings.cross_talk * draw.standard_normal((2, repeats, 2))
        deviates = draw.standard_normal((repeats, 2))
        if settings.tilt_presses:
            dof = settings.tilt_presses - 1
            deviates /= np.sqrt(draw.chisquare(dof, (repeats, 2)) / dof)
        lean: Array = np.radians(np.array(settings.tilt) + np.array(settings.tilt_error) * deviates)
        if settings.tilt_presses:
            lean -= into_drag
        self._normal_shares: Array = into_drag + lean
        self._drag_shares: Array = into_normal - lean

    def shares(self, direction: Array) -> tuple[Array, Array]:
        """Return the shares of N in T, and of T in N, (repeats,) [-] each, for a drag along a unit vector (2,)."""
        return self._normal_shares @ direction, self._drag_shares @ direction

    def ratio(self, value: float | Array, direction: Array) -> Array:
        """Return the true T/N (repeats,) [-] for a measured T/N `value`."""
        normal_share, drag_share = self.shares(direction)
        return (value * self.gain_t + normal_share) / (self.gain_n + drag_share * value)


def drag_direction(force: Array) -> Array:
    """Return the unit vector (2,) of the sum of forces (n, 2) [N]; along +x where the sum is zero."""
    x, y = float(np.nansum(force[:, 0])), float(np.nansum(force[:, 1]))
    length = float(np.hypot(x, y))
    return np.array([x, y]) / length if length > 0.0 else np.array([1.0, 0.0])


@dataclass(frozen=True, slots=True)
class StrokeIntervals:
    """Intervals of one stroke's numbers, None for each number that is withheld or has too few readings."""

    stroke: int  # position in `Analysis.strokes`
    trial: int | None
    mu_static: Interval | None  # [-]
    mu_dynamic: Interval | None  # [-]
    mu_max: Interval | None  # [-]
    tau_max: Interval | None  # [MPa]; the contact area, or its law, is taken as given
    speed: Interval | None  # [mm/s]
    normal_force: Interval | None  # mean over the steady window [N]
    tangential_force: Interval | None  # mean over the steady window [N]
    peak_normal: Interval | None  # [N]
    peak_tangential: Interval | None  # [N]
    heading: Interval | None  # around the reported angle: an end may exceed 180 [degrees]
    direction_agrees: float | None  # share of repeats in which the direction is the reported one [-]
    onset: Interval | None  # [s, device time]
    break_away: Interval | None  # [s, device time]
    slide_onset: Interval | None  # [s, device time]


# The numbers of a stroke that have an interval.
NUMBERS = tuple(
    column.name for column in fields(StrokeIntervals) if column.name not in ("stroke", "trial", "direction_agrees")
)


def stroke_intervals(stroke: Stroke, number: int, settings: BootstrapSettings | None = None) -> StrokeIntervals:
    """Return the intervals of the stroke at position `number`; the same stroke and seed give the same bits."""
    settings = settings or BootstrapSettings()
    repeats = _repeats(stroke, number, settings)
    tails = (1 - settings.confidence) / 2, (1 + settings.confidence) / 2

    def interval(name: str) -> Interval | None:
        value = getattr(stroke, name)
        if name not in repeats or value is None:
            return None
        low, high = np.quantile(repeats[name], tails).tolist()
        # An instant at the end of the stretch in which it may lie, such as the first reading after it, belongs to it. A
        # known tilt that was not levelled moves the truth off the reported number, which is included as well.
        contains_value = name in ("onset", "slide_onset") or settings.tilt != (0.0, 0.0)
        return (min(low, value), max(high, value)) if contains_value else (low, high)

    agrees = None
    if stroke.direction is not None and "heading" in repeats:  # within 60 degrees of the reported one
        agrees = float(np.mean(stroke.direction * np.cos(np.radians(repeats["heading"])) >= 0.5))
    return StrokeIntervals(number, stroke.trial, **{name: interval(name) for name in NUMBERS}, direction_agrees=agrees)


def intervals_document(settings: BootstrapSettings, intervals: Iterable[StrokeIntervals]) -> dict[str, Any]:
    """Return intervals as plain data, with their meaning and the settings of their draws."""
    rows = [asdict(interval) for interval in intervals]
    return {"kind": settings.kind, "kinds": dict(settings.kinds), "settings": asdict(settings), "strokes": rows}


def _repeats(stroke: Stroke, number: int, settings: BootstrapSettings) -> Mapping[str, Array]:
    """Return the numbers (repeats,) of the stroke at position `number`, by name; none for a curve that is too short."""
    if stroke.curve is None or len(stroke.curve.time) < 3:
        return {}
    return _Repeats(stroke, stroke.curve, settings, np.random.default_rng([settings.seed, number])).numbers()


class FrictionDraws(NamedTuple):
    """Joint draws of a stroke's friction, (repeats,) each."""

    mu: Array  # [-]
    tau_max: Array  # [MPa]
    normal_force: Array | None  # mean over the steady window [N]; None without one


def friction_draws(
    stroke: Stroke, number: int, rule: str, settings: BootstrapSettings | None = None
) -> FrictionDraws | None:
    """Return mu, tau_max and normal force of each repeat; None without mu or tau_max.

    `stroke_intervals` takes quantiles of the same draws; a calibration error moves mu and tau_max together.
    """
    repeats = _repeats(stroke, number, settings or BootstrapSettings())
    name = "mu_max" if rule == "maximum" else "mu_dynamic"
    if name not in repeats or "tau_max" not in repeats:
        return None
    return FrictionDraws(repeats[name], repeats["tau_max"], repeats.get("normal_force"))


def mean_inflation(blocks: Array, settings: BootstrapSettings) -> tuple[float, float]:
    """Return the inflation of the standard error of a mean of correlated blocks (k,) and its degrees of freedom.

    Correlated neighbours count for fewer: in a first-order autoregression n (1 - r) / (1 + r) are independent (Bayley
    and Hammersley 1946, Suppl. J. R. Stat. Soc. 8:184). Estimated from n blocks about their own mean, r is too small by
    (1 + 4 r) / n (Marriott and Pope 1954, Biometrika 41:390; Kendall 1954, 41:403), corrected here.
    """
    n = len(blocks)
    deviations = blocks - blocks.mean()
    squares = float(deviations @ deviations)
    lag_one = 0.0 if squares == 0.0 else float(deviations[1:] @ deviations[:-1]) / squares
    correlation = settings.most_alike
    if n > 4:
        correlation = min(max((lag_one + 1.0 / n) / (1.0 - 4.0 / n), 0.0), correlation)
    inflation = ((1.0 + correlation) / (1.0 - correlation)) ** 0.5
    return inflation, max(n / inflation**2 - 1.0, settings.least_free)


class _Repeats:
    """The draws shared by all numbers of one stroke in each repeat."""

    def __init__(
        self, stroke: Stroke, curve: StrokeCurve, settings: BootstrapSettings, draw: np.random.Generator
    ) -> None:
        self._stroke, self._curve, self._settings, self._draw = stroke, curve, settings, draw
        n = settings.repeats
        self._step = float(np.median(np.diff(curve.time)))
        self._systematic = SystematicDraws(settings)
        self._gain_t, self._gain_n = self._systematic.gain_t, self._systematic.gain_n
        self._noise_t, self._noise_n = curve.noise
        # The drift is one length over three axes; the zero is uniformly distributed within it.
        drift = (stroke.zero_drift or 0.0) / np.sqrt(3.0 * 12.0)
        independent = np.sqrt(max(1.0, curve.quiet / settings.block))
        self._zero_t_sd = float(np.hypot(drift, self._noise_t / independent))
        self._zero_t = self._zero_t_sd * draw.standard_normal(n)
        self._zero_n = np.hypot(drift, self._noise_n / independent) * draw.standard_normal(n)

    def numbers(self) -> dict[str, Array]:
        """Return the numbers (repeats,) of each repeat, by name."""
        numbers, stroke, curve = dict[str, Array](), self._stroke, self._curve
        if stroke.tau_max is not None and stroke.peak_tangential:
            area = stroke.contact_area or stroke.peak_tangential / stroke.tau_max
            if curve.crests is None:
                crests, peak_error = curve.tangential, self._peak_error(curve.tangential, self._noise_t)
            else:
                crests, peak_error = curve.crests, curve.crest_gap * self._draw.uniform(size=self._settings.repeats)
                peak_error += self._peak_error(crests, curve.crest_noise, filtered=False)
            crest = int(np.nanargmax(crests))
            normal_share, _ = self._systematic.shares(drag_direction(curve.force[crest : crest + 1]))
            offset = self._zero_t + peak_error + normal_share * curve.normal[crest]
            peak = stroke.tau_max * area * self._gain_t + offset
            numbers["tau_max"] = peak / (area * self._gain_n**stroke.area_exponent)
            numbers["peak_tangential"] = stroke.peak_tangential * self._gain_t + offset
        for name in ("mu_static", "mu_max"):
            value = getattr(stroke, name)
            if value is not None:
                numbers[name] = self._single_ratio(value)
        numbers |= self._window()
        if stroke.peak_normal is not None:
            peak_error, crest = self._peak_error(curve.normal, self._noise_n), int(np.nanargmax(curve.normal))
            _, drag_share = self._systematic.shares(drag_direction(curve.force[crest : crest + 1]))
            offset = self._zero_n + drag_share * curve.tangential[crest]
            numbers["peak_normal"] = stroke.peak_normal * self._gain_n + offset + peak_error
        speed = numbers.get("speed")
        instants = {"break_away": self._break_away(), "slide_onset": self._slide_onset(speed), "onset": self._onset()}
        return numbers | {name: draws for name, draws in instants.items() if draws is not None}

    def _peak_error(self, force: Array, noise: float, *, filtered: bool = True) -> Array:
        """Return draws of the true greatest force less the reported one (repeats,) [N].

        Noise raised the reported peak about as much as fresh noise raises the reported peak on average.
        """
        candidates = force[force >= self._settings.top_share * np.nanmax(force)]
        correlation_time = self._settings.top_alike * self._settings.block if filtered else 0.0
        every = max(1, round(correlation_time / self._step))
        candidates = candidates[::every]
        peaks = (candidates + noise * self._draw.standard_normal((self._settings.repeats, len(candidates)))).max(axis=1)
        return peaks - 2.0 * peaks.mean() + candidates.max()

    def _single_ratio(self, value: float) -> Array:
        """Return draws (repeats,) of a ratio from one short stretch, taken where T/N is nearest to it."""
        ratio = self._curve.ratio
        nearest = int(np.nanargmin(np.abs(ratio - value)))
        normal = float(self._curve.normal[nearest])
        noise = np.hypot(self._noise_t, value * self._noise_n) / normal
        from_zero = (self._zero_t - value * self._zero_n) / normal
        direction = drag_direction(self._curve.force[nearest : nearest + 1])
        scatter = noise * self._draw.standard_normal(len(self._gain_t))
        return self._systematic.ratio(value, direction) + from_zero + scatter

    def _window(self) -> dict[str, Array]:
        """Return dynamic friction and speed (repeats,) from resampled blocks of the steady window."""
        steady, settings = self._stroke.steady, self._settings
        if steady is None or self._stroke.mu_dynamic is None:
            return {}
        curve = self._curve
        inside = (curve.time >= steady[0]) & (curve.time <= steady[1]) & np.isfinite(curve.ratio)
        columns = (curve.ratio, 1.0 / np.where(inside, curve.normal, 1.0), curve.time, curve.position, curve.normal)
        window = np.column_stack([*columns, curve.tangential, curve.force])[inside]
        length = max(1, round(settings.block / self._step))
        count = len(window) // length
        if count < settings.fewest_blocks:
            return {}
        blocks = window[: count * length].reshape(count, length, window.shape[1]).mean(axis=1)
        positions, weight, inside_window = self._sample(count)
        sample = blocks[positions]  # (repeats, blocks, 9)
        total = weight.sum(axis=1)
        means = np.einsum("rbc,rb->rc", sample, weight) / total[:, None]
        # A mean of few or correlated blocks varies more than resampling shows.
        inflation, dof = mean_inflation(blocks[:, 0], settings)
        inflation *= np.sqrt(total / np.maximum(total - 1.0, 1.0) * dof / self._draw.chisquare(dof, len(total)))
        lightness = float(blocks[:, 1].mean())
        mu = self._stroke.mu_dynamic + (means[:, 0] - blocks[:, 0].mean()) * inflation
        direction = drag_direction(curve.force[inside])
        normal_share, drag_share = self._systematic.shares(direction)
        from_zero = (self._zero_t - self._stroke.mu_dynamic * self._zero_n) * lightness
        numbers = {"mu_dynamic": self._systematic.ratio(mu, direction) + from_zero}
        if self._stroke.normal_force is not None and self._stroke.tangential_force is not None:
            # A force may vary along the stroke: its mean varies with the window, not with resampled blocks. Windows are
            # drawn inwards, where N may be greater, but might have been wider: they are centred on their mean.
            force_means = inside_window @ blocks[:, 5:7] / total[:, None]
            force_means -= force_means.mean(axis=0)
            normal, tangential = self._stroke.normal_force, self._stroke.tangential_force
            shared_n, shared_t = drag_share * tangential + self._zero_n, normal_share * normal + self._zero_t
            numbers["normal_force"] = (normal + force_means[:, 0]) * self._gain_n + shared_n
            numbers["tangential_force"] = (tangential + force_means[:, 1]) * self._gain_t + shared_t
        velocity = means[:, 7:] + self._zero_t_sd * self._draw.standard_normal((len(means), 2))
        if self._stroke.speed is not None and np.isfinite(blocks[:, 3:5]).all():
            velocity = self._slopes(sample, weight) * self._systematic.gain_torque[:, None]
            normal_gain = self._gain_n + drag_share * self._stroke.mu_dynamic
            numbers["speed"] = np.hypot(velocity[:, 0], velocity[:, 1]) / normal_gain
        if (heading := self._stroke.heading) is not None:
            gain_ratio = 1.0 + settings.gain_error * np.sqrt(2.0) * self._draw.standard_normal(len(velocity))
            angle = np.degrees(np.arctan2(velocity[:, 1] * gain_ratio, velocity[:, 0]))
            numbers["heading"] = heading + (angle - heading + 180.0) % 360.0 - 180.0  # within half a turn of it
        return numbers

    def _break_away(self) -> Array | None:
        """Return the break-away (repeats,), where the analysis found it and no person decided it."""
        stroke, curve = self._stroke, self._curve
        if stroke.steady is None or stroke.break_away is None or "stick" in stroke.decided:
            return None
        stretch = (curve.time >= (stroke.onset or -np.inf)) & (curve.time <= stroke.steady[1])
        columns = (curve.time[stretch], curve.ratio[stretch], curve.normal[stretch])
        shortest = stroke.steady[1] - self._settings.inwards * (stroke.steady[1] - stroke.steady[0])
        zero, peaked = (self._zero_t, self._zero_n), stroke.mu_static is not None
        return break_away_draws(columns, shortest, zero, self._settings, self._draw, peaked=peaked)

    def _slide_onset(self, speed: Array | None) -> Array | None:
        """Return the slide's onset (repeats,), where the analysis found it and no person decided it."""
        stroke, curve = self._stroke, self._curve
        if stroke.steady is None or stroke.slide_onset is None or speed is None or "slide_onset" in stroke.decided:
            return None
        inside = (curve.time >= stroke.steady[0]) & (curve.time <= stroke.steady[1])
        stretch = (curve.time >= (stroke.onset or -np.inf)) & (curve.time <= stroke.steady[0])
        noise = float(np.nanstd(curve.speed[inside])) * self._draw.standard_normal(len(speed))
        threshold = self._draw.uniform(*self._settings.slide_share, len(speed)) * speed
        return slide_onset_draws(curve.time[stretch], curve.speed[stretch], threshold, noise, self._draw)

    def _onset(self) -> Array | None:
        """Return the onset (repeats,), where the readings show it and no person decided it."""
        onset, curve = self._stroke.onset, self._curve
        if onset is None or "onset" in self._stroke.decided:
            return None
        quiet = curve.unfiltered[curve.time < onset - self._settings.quiet_before]
        quiet = quiet[np.isfinite(quiet)]
        if len(quiet) < self._settings.fewest_quiet:
            return None
        noise = float(quiet.std())
        # The noise, and with it the threshold, is estimated from these readings, with an error.
        band = self._settings.detector.leave_noise * noise / np.sqrt(2.0 * len(quiet))
        zero_error = self._zero_n + band * self._draw.standard_normal(self._settings.repeats)
        return onset_draws((curve.time, curve.unfiltered), onset, noise, zero_error, self._settings, self._draw)

    def _sample(self, count: int) -> tuple[Indices, Array, Array]:
        """Return each repeat's drawn blocks, 1 for those to use, 1 for blocks in its window, (repeats, count) each."""
        repeats = self._settings.repeats
        trim = self._settings.inwards * count * self._draw.uniform(size=(2, repeats))
        starts, stops = np.floor(trim[0]), count - np.floor(trim[1])
        stops = np.maximum(stops, starts + min(count, 3))
        starts = np.minimum(starts, stops - 3)
        length = stops - starts
        positions = starts[:, None] + np.floor(self._draw.uniform(size=(repeats, count)) * length[:, None])
        weight = (np.arange(count) < length[:, None]).astype(np.float64)
        blocks = np.arange(count)
        in_window = (blocks >= starts[:, None]) & (blocks < stops[:, None])
        return np.clip(positions, 0, count - 1).astype(np.int64), weight, in_window.astype(np.float64)

    def _slopes(self, sample: Array, weight: Array) -> Array:
        """Return the slope of position on time (repeats, 2) [mm/s] over the blocks drawn."""
        total = weight.sum(axis=1)[:, None]
        time, position = sample[:, :, 2], sample[:, :, 3:5]
        centred_time = time - (time * weight).sum(axis=1)[:, None] / total
        spread = np.maximum((centred_time**2 * weight).sum(axis=1), 1e-9)[:, None]
        return ((centred_time * weight)[:, :, None] * position).sum(axis=1) / spread
