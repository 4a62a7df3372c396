"""Coverage of the 95 % intervals of friction on simulated strokes, in nine kinds of trouble, and false static peaks.

Every bench errs as its stated accuracy allows: gains and cross-talk of the forces are drawn with a standard deviation
of 1 %, the tilt of the face with 1° about each axis. A set adds its own trouble. None of its strokes has a static peak.
Beside a share stands that of the errors alone which all strokes of a bench have in common: chance is in both alike.
"""

import argparse
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from drivers.arrays import Array
from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import Block, Frame, SessionPlan, Stimulus, Trial
from sessions.strokes.analysis import Analysis, analyse_blocks
from sessions.strokes.bootstrap import SystematicDraws, drag_direction
from sessions.strokes.settings import AnalysisSettings, BootstrapSettings
from sessions.strokes.trial_analysis import TrialContext
from simulators.bench import RATED, Bench, BenchSettings, StrokeGroundTruth
from simulators.stroke import CONTACT_AREA, paper_surfaces
from simulators.subject import SimulatedSubject

Truth = dict[str, float]

RATE = 200.0  # [Hz]
ACCURACY = 0.01  # standard deviation of gains and of cross-talk [-]
LEAN = 1.0  # standard deviation of the face's lean about each axis [degrees]
PUSH = 0.01  # standard deviation of a press's lateral force, relative to N [-]
FINE = 20000  # instants for the true largest force and the true mean
HEIGHT = BenchSettings().height
CALIBRATION = Calibration("FT0001", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.array(RATED), "the bench's own")
INFO = TransducerInfo("sim:", "net-ft", "SIMULATED", "FT0001", True, RATE, 7000.0, CALIBRATION, {})
NUMBERS = ("mu_dynamic", "tau_max", "speed")


@dataclass(frozen=True)
class Trouble:
    """Disturbances of the benches and strokes of a set."""

    bench: BenchSettings = field(default_factory=BenchSettings)
    hum: float = 0.0  # amplitude at 50 Hz on each force [N]
    flicker: float = 0.0  # standard deviation of 1/f noise of each force [N]
    wander: float = 0.0  # standard deviation of mu's slow wandering [-]
    law: float = 0.0  # exponent of mu as a power of N [-]
    cross_talk: float | None = None  # cross-talk between any two forces, of either sign; None: random [-]
    tilt: tuple[float, float] | None = None  # [degrees]; None: random
    presses: int = 0  # before the strokes, from which the analysis measures the tilt
    level: bool = False  # the true mu is the level about which it wanders, not its mean over the stroke
    slips: bool = False  # stick-slip: T/N repeatedly rises and drops while the finger slides


SETS = {
    "base": Trouble(),
    "noise x 5": Trouble(BenchSettings(noise_force=0.02, noise_torque=0.25)),
    "drift x 5": Trouble(BenchSettings(drift_force=0.05, drift_torque=0.5)),
    "mains hum": Trouble(hum=0.02),
    "1/f noise": Trouble(flicker=0.01),
    "wandering mu": Trouble(wander=0.03),
    "wandering mu, its level": Trouble(wander=0.03, level=True),
    "cross-talk 1 %": Trouble(cross_talk=0.01),
    "tilt 1 + 1 degrees": Trouble(tilt=(1.0, 1.0)),
    "tilt 1 + 1 degrees, 3 presses": Trouble(tilt=(1.0, 1.0), presses=3),
    "stick-slip": Trouble(slips=True),
    "mu falls with N": Trouble(law=-1.0 / 3.0),
}


class Visit:
    """Ten strokes of one simulated subject on one bench with errors."""

    def __init__(self, seed: int, trouble: Trouble) -> None:
        """Draw the errors of the bench and the changes of friction along each stroke."""
        self._trouble, self._seed = trouble, seed
        draw = np.random.default_rng([seed, 77])
        self._bench, self._subject = Bench(seed, trouble.bench), SimulatedSubject(seed)
        size = trouble.cross_talk
        errors = ACCURACY * draw.standard_normal((3, 3))
        if size is not None:
            errors = np.where(np.eye(3) > 0.0, errors, size * draw.choice([-1.0, 1.0], (3, 3)))
        self._errors = np.eye(6)
        self._errors[:3, :3] += errors
        self._errors[3:, 3:] += np.diag(ACCURACY * draw.standard_normal(3))
        tilt = trouble.tilt or tuple((LEAN * draw.standard_normal(2)).tolist())
        self._turn = Rotation.from_euler("xy", tilt, degrees=True).as_matrix()  # face's frame to transducer's
        self._hand = np.random.default_rng([seed, 78])
        self._phases = draw.uniform(0.0, 2.0 * np.pi, 8)
        self._slips_each = draw.uniform(5.0, 15.0)  # [Hz]
        self._drop = draw.uniform(0.1, 0.3)  # of mu in each slip [-]

    def strokes(self) -> tuple[Analysis, list[Truth], list[Array]]:
        """Return the analysis of the ten strokes, the truth of each, and its true force (3,) at mid-stroke [N]."""
        recordings: list[tuple[Trial, ReadingBlock]] = []
        truths: list[Truth] = []
        forces: list[Array] = []
        surfaces = paper_surfaces()
        for number in range(self._trouble.presses):
            surface = next(iter(surfaces.values()))
            time = np.arange(np.ceil(2.5 * number * RATE), 2.5 * (number + 1) * RATE) / RATE
            trial = Trial(len(surfaces) + 1 + number, "b", Stimulus("slipperiness", surface.index, "P"), 1, 1)
            recordings.append((trial, _block(time, self._measured_wrench(time, self._press(time - time[0])))))
        begin = 2.5 * self._trouble.presses + 0.5
        for number, surface in enumerate(surfaces.values(), 1):
            self._bench.mount(surface)
            stroke = self._bench.begin_stroke(self._subject.stroke(surface), begin)
            time = np.arange(np.ceil((begin - 0.2) * RATE), (stroke.end + 0.6) * RATE) / RATE
            trial = Trial(number, "b", Stimulus("slipperiness", surface.index, f"K{number}"), surface.direction, 1)
            recordings.append((trial, _block(time, self._measured_wrench(time, self._true_wrench(time, stroke)))))
            truths.append(self._truth(stroke))
            forces.append(self._true_wrench(np.array([np.mean(stroke.steady)]), stroke)[0, :3])
            begin = stroke.end + 1.0
        blocks = (Block("b", "", 1, 2.0, ("", ""), tuple(trial for trial, _ in recordings)),)
        plan = SessionPlan("sensotact", "S1", 0, "given", blocks, forces=True, frame=Frame("-z", "set", HEIGHT, "set"))
        return analyse_blocks(recordings, TrialContext(plan, INFO, AnalysisSettings())), truths, forces

    def errors_alone(self, force: Array, settings: BootstrapSettings) -> dict[str, bool]:
        """Return whether intervals from gains, cross-talk and tilt alone contain mu and T of a true force (3,) [N]."""
        reading = self._errors[:3, :3] @ self._turn @ force
        systematic = SystematicDraws(settings)
        along = drag_direction(reading[None, :2])
        drag, normal = float(np.hypot(*reading[:2])), -float(reading[2])
        true = float(np.hypot(*force[:2]))
        draws = {
            "mu_dynamic": (systematic.ratio(drag / normal, along), drag / normal, true / -float(force[2])),
            "tau_max": (drag * systematic.gain_t + systematic.shares(along)[0] * normal, drag, true),
        }
        holds: dict[str, bool] = {}
        for name, (draw, estimate, truth) in draws.items():
            estimates = [] if settings.tilt == (0.0, 0.0) else [estimate]  # of a face that is not levelled
            low, high = np.quantile(draw, (0.025, 0.975))
            holds[name] = min([low, *estimates]) <= truth <= max([high, *estimates])
        return holds

    def _truth(self, stroke: StrokeGroundTruth) -> Truth:
        steady = np.linspace(*stroke.steady, FINE)
        contact = np.linspace(stroke.touch, stroke.end, FINE)
        tangential = np.hypot(*self._true_wrench(contact, stroke)[:, :2].T)
        mu = stroke.mu * (1.0 if self._trouble.level else float(self._factor(steady, stroke).mean()))
        return {"mu_dynamic": mu, "tau_max": float(tangential.max()) / CONTACT_AREA, "speed": stroke.speed}

    def _factor(self, time: Array, stroke: StrokeGroundTruth) -> Array:
        """Return the ratio of mu to the surface's nominal mu (n,) [-] at `time` (n,) [s]."""
        factor = np.ones_like(time)
        if self._trouble.wander:
            waves = np.sin(2 * np.pi * np.outer([0.4, 0.9, 1.7], time) + self._phases[:3, None])
            factor += self._trouble.wander * np.sqrt(2.0 / 3.0) * waves.sum(axis=0)
        if self._trouble.slips:
            phase = np.maximum(time - stroke.slip, 0.0) * self._slips_each % 1.0
            # A rise over nine tenths of the period, then a drop of 7 to 20 ms, as fingers' relaxation allows.
            sawtooth = np.where(phase < 0.9, phase / 0.9, (1.0 - phase) / 0.1)
            factor *= np.where(time > stroke.slip, 1.0 - self._drop * (1.0 - sawtooth), 1.0)
        if self._trouble.law:
            push = np.maximum(-self._bench.true_wrench(time)[:, 2], 1e-3)
            factor *= (push / stroke.peak_normal_force) ** self._trouble.law
        return factor

    def _true_wrench(self, time: Array, stroke: StrokeGroundTruth) -> Array:
        """Return the true wrench (n, 6) [N, N mm] in the face's frame."""
        plain = self._bench.true_wrench(time)
        extra = plain[:, :2] * (self._factor(time, stroke) - 1.0)[:, None]
        push = np.minimum(plain[:, 2], -1e-12)
        x = (HEIGHT * plain[:, 0] - plain[:, 4]) / push
        y = (plain[:, 3] + HEIGHT * plain[:, 1]) / push
        torques = np.column_stack([-HEIGHT * extra[:, 1], HEIGHT * extra[:, 0], x * extra[:, 1] - y * extra[:, 0]])
        return plain + np.hstack([extra, np.zeros((len(time), 1)), torques])

    def _press(self, time: Array) -> Array:
        """Return the true wrench (n, 6) of a press of 2 N for 1.5 s, with a small random lateral force."""
        normal = 2.0 * np.clip(np.minimum(time - 0.5, 2.1 - time) / 0.1, 0.0, 1.0)
        x, y = PUSH * self._hand.standard_normal((2, 1)) * normal
        return np.column_stack([x, y, -normal, -HEIGHT * y, HEIGHT * x, np.zeros_like(time)])

    def _measured_wrench(self, time: Array, true: Array) -> Array:
        """Return the wrench (n, 6) [N, N mm] that the transducer measures for a true wrench in the face's frame."""
        wrench = np.hstack([true[:, :3] @ self._turn.T, true[:, 3:] @ self._turn.T])
        reading = wrench @ self._errors.T + self._bench.wrench(time) - self._bench.true_wrench(time)
        if self._trouble.hum:
            reading[:, :3] += self._trouble.hum * np.sin(2 * np.pi * 50.0 * time[:, None] + self._phases[3:6])
        if self._trouble.flicker:
            reading[:, :3] += self._trouble.flicker * _flicker(len(time), 3, (self._seed, int(time[0] * RATE)))
        return reading


def _block(time: Array, wrench: Array) -> ReadingBlock:
    """Return readings of a wrench (n, 6) [N, N mm] in counts."""
    position = np.rint(time * RATE).astype(np.int64)
    counts = np.rint(wrench / np.diag(CALIBRATION.matrix))
    return ReadingBlock(position, position, np.zeros_like(position), time, np.rint(time * 1e9).astype(np.int64), counts)


def _flicker(n: int, channels: int, seed: Sequence[int]) -> Array:
    """Return 1/f noise (n, channels) with a standard deviation of 1."""
    spectrum = np.fft.rfft(np.random.default_rng(seed).standard_normal((n, channels)), axis=0)
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))[:, None]
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, n, axis=0)
    return noise / noise.std(axis=0)


def row(name: str, seeds: Sequence[int]) -> str:
    """Return the coverage of a set's intervals over ten strokes of each seed, as a row of a table."""
    hits: dict[str, list[bool | None]] = defaultdict(list)  # None: no interval
    alone: dict[str, list[bool]] = defaultdict(list)  # with intervals from the common errors alone
    peaks: list[bool] = []
    for seed in seeds:
        visit = Visit(seed, SETS[name])
        analysis, truths, forces = visit.strokes()
        for force in forces:
            for number, holds in visit.errors_alone(force, analysis.bootstrap).items():
                alone[number].append(holds)
        at_trial = {stroke.trial: (index, stroke) for index, stroke in reversed(list(enumerate(analysis.strokes)))}
        for trial, truth in enumerate(truths, 1):
            index, stroke = at_trial.get(trial, (0, None))
            intervals = None if stroke is None else analysis.intervals[index]
            peaks.append(stroke is not None and stroke.mu_static is not None)
            for number in NUMBERS:
                limits = None if intervals is None else getattr(intervals, number)
                hits[number].append(None if limits is None else limits[0] <= truth[number] <= limits[1])
    cells = [name]
    for number in NUMBERS:
        decisions = [hit for hit in hits[number] if hit is not None]
        cells.append(f"{100 * np.mean(decisions or [np.nan]):.1f} %")
        cells[-1] += f" ({100 * np.mean(alone[number]):.1f} %)" if number in alone else ""
    withheld = max(ones.count(None) / len(ones) for ones in hits.values())
    return "| " + " | ".join((*cells, *(f"{100 * share:.1f} %" for share in (withheld, np.mean(peaks))))) + " |"


def main() -> None:
    """Print a row for each set, for the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=100, help="sessions of each set")
    parser.add_argument("first", nargs="?", type=int, default=5000, help="seed of the first")
    parser.add_argument("sets", nargs="*", metavar="SET", help="its name; without one, all")
    options = parser.parse_args()
    if unknown := set(options.sets) - set(SETS):
        parser.error(f"there is no set {', '.join(unknown)}; there are {', '.join(SETS)}")
    header = ("set", *(f"`{name}`" for name in NUMBERS), "withheld", "static peaks")
    print("| " + " | ".join(header) + " |\n" + "| --- " * len(header) + "|")
    for name in options.sets or SETS:
        print(row(name, range(options.first, options.first + options.count)), flush=True)


if __name__ == "__main__":
    main()
