"""The simulated bench: a stimulus on a six-axis transducer, a finger that strokes it, and the measured wrench."""

import threading
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from drivers.arrays import Array
from drivers.calibration import Calibration
from drivers.clock import Clock
from drivers.readings import ReadingBlock
from drivers.transducer import Health, TransducerInfo
from simulators.stroke import CONTACT_AREA, PRESS, RELEASE, Course, Stroke, Surface


def _white_noise(seed: int, times: Array, channels: int = 6) -> Array:
    """Return noise (n, channels) of mean 0 and standard deviation 1 at `times` (n,) [s].

    Instants in the same microsecond share their noise. The hash is SplitMix64 (Steele, Lea, Flood, 2014), keyed by the
    seed and indexed by instant and channel; the inverse normal distribution gives the deviates.
    """
    instants = np.rint(times * 1e6).astype(np.int64).astype(np.uint64)
    counter = instants[:, None] * np.uint64(channels) + np.arange(channels, dtype=np.uint64)
    bits = _key(seed) + counter * np.array([0x9E3779B97F4A7C15], np.uint64)
    bits = (bits ^ (bits >> np.uint64(30))) * np.array([0xBF58476D1CE4E5B9], np.uint64)
    bits = (bits ^ (bits >> np.uint64(27))) * np.array([0x94D049BB133111EB], np.uint64)
    bits ^= bits >> np.uint64(31)
    uniform = ((bits >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    deviates = map(NormalDist().inv_cdf, uniform.ravel().tolist())  # SciPy's is faster, but takes 0.2 s to load
    return np.fromiter(deviates, np.float64, uniform.size).reshape(uniform.shape)


@cache
def _key(seed: int) -> npt.NDArray[np.uint64]:
    return np.array([*np.random.SeedSequence(seed).generate_state(1, np.uint64)], np.uint64)


Six = tuple[float, float, float, float, float, float]

RATED: Six = (36.0, 36.0, 36.0, 500.0, 500.0, 500.0)  # an SI-36-0.5 calibration [N, N mm]


@dataclass(frozen=True, slots=True)
class BenchSettings:
    """Errors of the bench. Forces are in N, torques in N mm."""

    noise_force: float = 0.004  # standard deviation of the white noise of each force [N]
    noise_torque: float = 0.05  # and of each torque [N mm]
    drift_force: float = 0.010  # largest drift of a force from its zero [N]
    drift_torque: float = 0.1  # largest drift of a torque from its zero [N mm]
    drift_period: tuple[float, float] = (120.0, 600.0)  # limits of the period of each axis' sinusoidal drift [s]
    offset: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # unloaded reading: weight of the plate, strain of the mounting
    gains: Six = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)  # measured over true; 1 with an exact calibration [-]
    tilt: tuple[float, float] = (0.0, 0.0)  # of the stimulus about the transducer's x and y axes [degrees]
    height: float = 20.0  # of the stimulus's face above the transducer's origin [mm]
    rated: Six = RATED  # limits at which an axis saturates


@dataclass(frozen=True, slots=True)
class StrokeGroundTruth:
    """Ground truth of one stroke. Times are the bench's [s]."""

    surface: Surface
    mu: float  # [-]
    tau_max: float  # greatest tangential force over CONTACT_AREA [MPa]
    peak_normal_force: float  # [N]
    speed: float  # mean over the steady slide [mm/s]
    direction: int
    touch: float  # start of contact
    onset: float  # the true N first exceeds three standard deviations of the noise
    slip: float  # instant from which the whole contact slides
    peak: float  # of the normal force
    steady: tuple[float, float]  # full speed and full press
    lift: float  # the true N last exceeds three standard deviations of the noise
    end: float  # end of contact


class Bench:
    """One transducer with a mounted stimulus. The user defines time 0; threads may share the bench.

    The wrench is that of the finger on the stimulus in the transducer's frame: x from proximal to distal, z out of the
    face, so pressing is Fz < 0. Noise is a function of the seed and the instant.
    """

    def __init__(self, seed: int = 0, settings: BenchSettings | None = None) -> None:
        self.settings = settings or BenchSettings()
        self.seed = seed
        self.serial = f"SIM{seed:05d}"  # of the transducer, on simulated wires
        self._lock = threading.Lock()
        self._surface: Surface | None = None
        # Beginning [s], course and ground truth of each stroke; in order, never overlapping. Replaced, never mutated.
        self._strokes: tuple[tuple[float, Course, StrokeGroundTruth], ...] = ()
        self._rotation = _rotation(*self.settings.tilt)
        draw = np.random.default_rng([seed, 1])
        limits = np.repeat([self.settings.drift_force, self.settings.drift_torque], 3)
        self._drift_size = limits * draw.uniform(0.3, 1.0, 6)
        self._drift_rate = 2 * np.pi / draw.uniform(*self.settings.drift_period, 6)
        self._drift_phase = draw.uniform(0.0, 2 * np.pi, 6)

    def mount(self, surface: Surface) -> None:
        """Put a stimulus on the transducer, for later strokes."""
        with self._lock:
            self._surface = surface

    def begin_stroke(self, stroke: Stroke, time: float) -> StrokeGroundTruth:
        """Begin a stroke at `time` [s]; return its truth. Raises ValueError without a stimulus, or during a stroke."""
        with self._lock:
            surface = self._surface
            if surface is None:
                raise ValueError("nothing is mounted on the bench: mount a surface before a stroke begins")
            if self._strokes and time < self._strokes[-1][0] + self._strokes[-1][1].lift:
                raise ValueError(f"a stroke cannot begin at {time} s: the one before has not ended")
            course = Course(stroke, surface.mu, surface.holds)
            ground_truth = self._stroke_ground_truth(time, course, surface)
            self._strokes = (*self._strokes, (time, course, ground_truth))
        return ground_truth

    def ground_truth(self) -> tuple[StrokeGroundTruth, ...]:
        """Return the ground truth of every stroke begun so far, in order."""
        return tuple(ground_truth for _, _, ground_truth in self._strokes)

    def true_wrench(self, times: Array) -> Array:
        """Return the wrench (n, 6) [N, N mm] exerted by the finger at `times` (n,) [s], without any error."""
        wrench = np.zeros((len(times), 6))
        if not len(times):
            return wrench
        first, last = float(np.min(times)), float(np.max(times))
        for began, course, _ in reversed(self._strokes):
            if began + course.lift < first:
                break
            if began + course.touch <= last:
                wrench += _course_wrench(course, times - began, self.settings.height)
        forces, torques = wrench[:, :3], wrench[:, 3:]
        return np.hstack([forces @ self._rotation.T, torques @ self._rotation.T])

    def wrench(self, times: Array) -> Array:
        """Return the wrench (n, 6) [N, N mm] measured at `times` (n,) [s], with noise and drift."""
        settings = self.settings
        wrench = self.true_wrench(times) * np.array(settings.gains) + np.array(settings.offset)
        wrench += self._drift_size * np.sin(self._drift_rate * times[:, None] + self._drift_phase)
        return wrench + _white_noise(self.seed, times) * np.repeat([settings.noise_force, settings.noise_torque], 3)

    def _stroke_ground_truth(self, began: float, course: Course, surface: Surface) -> StrokeGroundTruth:
        start, stop = course.steady
        travel = course.position(np.array([start, stop]))
        limit = 3.0 * self.settings.noise_force
        press_times = np.linspace(course.touch, course.touch + PRESS, 15001)
        onset = press_times[np.argmax(course.normal_force(press_times) > limit)]
        release_times = np.linspace(course.lift, course.lift - RELEASE, 12001)
        lift = release_times[np.argmax(course.normal_force(release_times) > limit)]
        peak = course.stroke.peak_normal_force
        return StrokeGroundTruth(
            surface=surface,
            mu=course.mu,
            tau_max=course.mu * peak / CONTACT_AREA,
            peak_normal_force=peak,
            speed=float((travel[1] - travel[0]) / (stop - start)),
            direction=course.stroke.direction,
            touch=began + course.touch,
            onset=began + float(onset),
            slip=began + course.slip,
            peak=began + course.peak,
            steady=(began + start, began + stop),
            lift=began + float(lift),
            end=began + course.lift,
        )


def _course_wrench(course: Course, time: Array, height: float) -> Array:
    """Return the wrench (n, 6) of a course about the transducer's origin; the face is `height` [mm] above it."""
    stroke = course.stroke
    normal = course.normal_force(time)
    tangential = course.ratio(time) * normal
    along = stroke.direction * course.position(time)
    slant = np.radians(stroke.slant)
    x, y = along * np.cos(slant), along * np.sin(slant) + stroke.across
    fx, fy, fz = stroke.direction * tangential * np.cos(slant), stroke.direction * tangential * np.sin(slant), -normal
    # Torque is r x F with r = (x, y, height).
    return np.column_stack([fx, fy, fz, y * fz - height * fy, height * fx - x * fz, x * fy - y * fx])


def _rotation(about_x: float, about_y: float) -> Array:
    """Return the matrix (3, 3) that rotates the stimulus's axes about x, then about y [degrees]."""
    (sx, cx), (sy, cy) = ((np.sin(angle), np.cos(angle)) for angle in np.radians([about_x, about_y]))
    turn_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    turn_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return turn_y @ turn_x


# Nano43 FT32831, SI-36-0.5, calibrated 2020-12-14: N and N mm per volt of gauge, in the maker's sensing frame.
FT32831 = np.array(
    [
        [0.02098, -0.02876, -0.05237, 4.51544, -0.05447, -4.46284],
        [-0.13719, -5.12368, -0.04217, 2.58695, 0.04008, 2.52214],
        [2.97639, -0.01655, 3.01180, 0.02275, 3.00141, 0.01232],
        [-0.80476, -23.09345, 43.58858, 12.00245, -43.41430, 11.27584],
        [-50.56376, 0.53041, 25.49010, -20.29578, 25.13749, 20.18422],
        [-1.25627, -38.28410, 0.53176, -37.15623, -0.42515, -37.35515],
    ]
)


def calibration_file(folder: Path, serial: str) -> Path:
    """Write the maker's calibration file for simulated gauges with a serial number; return its path."""
    axes = "".join(
        f'<Axis Name="{name}" values="{" ".join(map(repr, row))}" max="{rated}" scale="1"/>\n'
        for name, row, rated in zip(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), FT32831.tolist(), RATED, strict=True)
    )
    path = folder / f"{serial}.cal"
    path.write_text(
        f'<?xml version="1.0"?><FTSensor Serial="{serial}" BodyStyle="Nano43" Family="DAQ" NumGages="6" '
        'CalFileVersion="1.0"><Calibration PartNumber="SIMULATED SI-36-0.5" CalDate="12/14/2020" ForceUnits="N" '
        'TorqueUnits="N-mm" DistUnits="mm" OutputMode="Ground Referenced Differential" OutputRange="20">\n'
        f"{axes}</Calibration></FTSensor>\n",
        encoding="utf-8",
    )
    return path


_RATE = 200.0  # readings a second
_MIDDLE = (0.3, 0.7)  # range of a stroke's slide that is lost or frozen [-]
_SCALE = np.array([1e-6] * 3 + [1e-3] * 3)  # one count [N, N mm]


class DirectTransducer:
    """The bench as a transducer without a wire, on simulated time, for studies within seconds.

    Readings are lost, or repeat one, in the middle of a chosen stroke, numbered on the bench from 1.
    """

    def __init__(self, bench: Bench, clock: Clock, *, lost: int = 0, frozen: int = 0) -> None:
        """Measure `bench`, whose time begins with the stream. Stroke `lost` loses readings, `frozen` repeats one."""
        calibration = Calibration(
            f"SIM{bench.seed}", "counts", np.diag(_SCALE), np.array(RATED), "of the simulated bench"
        )
        self.info = TransducerInfo(
            f"bench:{bench.seed}", "direct", "simulated bench", calibration.serial, True, _RATE, _RATE, calibration
        )
        self._bench = bench
        self._clock = clock
        self._lost_stroke, self._frozen_stroke = lost, frozen
        self._began_ns: int | None = None
        self._stopped = False
        self._sent = 0
        self._lost = 0

    @property
    def health(self) -> Health:
        return Health(received=self._sent - self._lost, lost=self._lost)

    def now(self) -> float:
        """Return the bench's time [s]."""
        return 0.0 if self._began_ns is None else (self._clock.now_ns() - self._began_ns) * 1e-9

    def start(self) -> None:
        self._began_ns = self._clock.now_ns()

    def stop(self) -> None:
        self._stopped = True

    def close(self) -> None:
        self.stop()

    def read(self, timeout: float) -> ReadingBlock:
        if self._began_ns is None or self._stopped:
            return ReadingBlock.empty()
        if self._due == self._sent:
            self._clock.sleep(timeout)
        numbers = np.arange(self._sent, self._due, dtype=np.int64)
        self._sent += len(numbers)
        start, stop = self._middle(self._lost_stroke)
        present = numbers[(numbers / _RATE < start) | (numbers / _RATE >= stop)]
        self._lost += len(numbers) - len(present)
        time = present / _RATE
        start, stop = self._middle(self._frozen_stroke)
        sample_times = np.where((time >= start) & (time < stop), start, time)
        counts = np.rint(self._bench.wrench(sample_times) / _SCALE)
        received = self._began_ns + np.rint(time * 1e9).astype(np.int64)
        return ReadingBlock(present, present, np.zeros_like(present), time, received, counts)

    @property
    def _due(self) -> int:
        return int(self.now() * _RATE) + 1

    def _middle(self, number: int) -> tuple[float, float]:
        """Return the middle stretch [s, bench] of a stroke that has begun; infinite times for another number."""
        truths = self._bench.ground_truth()
        if not 0 < number <= len(truths):
            return np.inf, np.inf
        stroke = truths[number - 1]
        first, last = (stroke.slip + fraction * (stroke.lift - stroke.slip) for fraction in _MIDDLE)
        return first, last
