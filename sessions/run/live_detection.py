"""Live detection: the zero of a take, touch and lift, and when the finger stays off.

Readings are never altered. A take begins with an unloaded stretch of at least `zero_duration`, before any contact, and
ends no earlier than `after_lift` seconds after the last lift. As in the analysis of the recording, readings that the
device marks as invalid and those beyond its rated range show neither zero nor contact.
"""

from dataclasses import dataclass

import numpy as np

from drivers.arrays import Array
from drivers.readings import ReadingBlock
from drivers.transducer import StatusCount, TransducerInfo, flagged_words
from sessions.plan.plan import Frame
from sessions.run.steps import ContactOnset, FingerLifted, Settled, Zeroed
from sessions.strokes.contacts import ContactDetector, is_quiet
from sessions.strokes.forces import normal_force
from sessions.strokes.settings import DetectorSettings
from sessions.strokes.signal_quality import saturated_readings

Noticed = Zeroed | ContactOnset | FingerLifted | Settled


@dataclass(eq=False)
class TakeWatch:
    """Watches the readings of one take: first until its zero is measured, then for the finger."""

    info: TransducerInfo
    frame: Frame
    zero_duration: float  # of the unloaded stretch [s]
    detection: DetectorSettings
    after_lift: float = 0.5  # time without a touch after which the finger counts as off [s]
    sound_only: bool = True  # leave out readings with invalid values

    def __post_init__(self) -> None:
        """Begin to measure the zero."""
        self._readings = self._invalid = 0
        self._causes = StatusCount(self.info.status)
        self._detector: ContactDetector | None = None
        self._stretch = ReadingBlock.empty()
        self._lifted: float | None = None  # when the finger left [s, device time]; None while it touches, or stayed off

    def feed(self, block: ReadingBlock) -> tuple[Noticed, ...]:
        """Process readings and return the events detected in them, in order."""
        if not len(block):
            return ()
        last_time = float(block.time[-1])
        if self.sound_only:
            block = self._sound(block)
        if self._detector is not None:
            return self._touches(self._detector, block, last_time)
        if not len(block):
            return ()
        stretch = ReadingBlock.concatenate([self._stretch, block])
        early = int(np.count_nonzero(stretch.time < stretch.time[-1] - self.zero_duration))
        self._stretch = stretch.between(early, len(stretch))
        zero = self._zero()
        if zero is None:
            return ()
        self._detector = ContactDetector(self.detection)
        # The detector learns the noise from the same stretch; nothing touched during it.
        self._detector.feed(self._stretch.time, self._normal_force(self._stretch))
        return (zero,)

    @property
    def zero_obstacle(self) -> str:
        """Return a sentence on why there is no zero yet, and what to do."""
        if 2 * self._invalid <= self._readings:
            return "the zero cannot be measured while something moves or touches; take hands off"
        cause = flagged_words(self._causes.flagged) or "beyond the rated range"
        return f"the zero cannot be measured: most readings are invalid ({cause}); relieve or repair the transducer"

    def _sound(self, block: ReadingBlock) -> ReadingBlock:
        """Return the readings with valid values, and count the others."""
        invalid = saturated_readings(block, self.info)
        self._readings += len(block)
        self._invalid += int(invalid.sum())
        self._causes.take(block.status[invalid])
        return block.where(~invalid)

    def _zero(self) -> Zeroed | None:
        """Return the zero of the stretch once it is long enough and quiet."""
        stretch = self._stretch
        duration = float(stretch.time[-1] - stretch.time[0])
        normal = self._normal_force(stretch)
        # One reading's step is allowed for, since the stretch holds whole readings only.
        step = duration / max(len(stretch) - 1, 1)
        if duration + step < self.zero_duration or not is_quiet(normal.tolist(), self.detection):
            return None
        return Zeroed(
            mean=tuple(stretch.raw.mean(axis=0).tolist()),
            spread=tuple(stretch.raw.std(axis=0, ddof=1).tolist()),
            readings=len(stretch),
            duration=duration,
            first_sequence=int(stretch.sequence[0]),
            last_sequence=int(stretch.sequence[-1]),
            normal_force=float(normal.mean()),
            noise=float(normal.std(ddof=1)),
        )

    def _touches(self, detector: ContactDetector, block: ReadingBlock, last_time: float) -> tuple[Noticed, ...]:
        notices: list[Noticed] = []
        for touches, time, noticed in detector.feed(block.time, self._normal_force(block)):
            notices.append((ContactOnset if touches else FingerLifted)(time, noticed))
            self._lifted = None if touches else time
        if self._lifted is not None and last_time - self._lifted >= self.after_lift:
            notices.append(Settled(last_time))
            self._lifted = None
        return tuple(notices)

    def _normal_force(self, block: ReadingBlock) -> Array:
        return normal_force(self.info.calibration.wrench(block.raw, np.zeros(6)), self.frame)
