"""The readings of a trial as they were recorded, for a table and for replay."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq_app.wording import tr
from drivers.readings import ReadingBlock
from sessions.recording import Recording
from sessions.recording.schema import LIVE_FILE, SEALED_FILE
from sessions.report.contents import StrokeFinding, same_fields
from sessions.strokes.forces import in_face_frame

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

AROUND = 1.0  # before and after a stroke of a recording without trials [s]
MOST_FOR_ZERO = 0.3  # of the readings before contact that give the zero of a replay [s]


@dataclass(frozen=True, slots=True, eq=False)
class RawReadings:
    """n readings and where they lie."""

    place: str  # file, data set and rows
    unit: str  # of `raw`
    sequence: Whole  # (n,)
    counter: Whole  # (n,)
    status: Whole  # (n,)
    received_ns: Whole  # (n,)
    time: Array  # (n,) [s, device time]
    raw: Array  # (n, 6)
    normal: Array  # (n,) unfiltered, `zero` taken off [N]
    tangential: Array  # (n,) likewise [N]
    zero: str  # which zero was taken off, for people

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.time)


class RawFile:
    """The readings of a recording, with the rows they have in its file; what is needed again is kept."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._whole: ReadingBlock | None = None  # of a recording without trials
        self._before: dict[tuple[int, int], int] | None = None  # rows before the block that begins so

    def around(self, stroke: StrokeFinding) -> RawReadings:
        """Return the readings of the take that holds a stroke, or of a recording without trials those around it."""
        block = self._block(stroke)
        return _with_forces(self._recording, stroke, block, self._place(block))

    def _block(self, stroke: StrokeFinding) -> ReadingBlock:
        if stroke.trial is not None:
            return self._recording.readings(stroke.trial)
        if self._whole is None:
            self._whole = self._recording.readings()
        begin = -np.inf if stroke.onset is None else stroke.onset - AROUND
        end = np.inf if stroke.lift is None else stroke.lift + AROUND
        return self._whole.between(*np.searchsorted(self._whole.time, [begin, end]).tolist())

    def _place(self, block: ReadingBlock) -> str:
        """Return file and data set of readings, with the rows they have there."""
        folder = self._recording.folder
        if not len(block):
            return tr("{name}: no readings", name=folder.name)
        first = self._row(int(block.sequence[0]), int(block.received_ns[0]))
        rows = "" if first is None else tr(", rows {first} to {last}", first=first, last=first + len(block) - 1)
        if (folder / SEALED_FILE).is_file():
            return tr("{name}/{file}, data sets readings/…{rows}", name=folder.name, file=SEALED_FILE, rows=rows)
        return tr("{name}/{file}, table blocks{rows}", name=folder.name, file=LIVE_FILE, rows=rows)

    def _row(self, sequence: int, received_ns: int) -> int | None:
        """Return the row of a reading; None where its block is damaged or gone."""
        if self._before is None:
            self._before, count = {}, 0
            for block in self._recording.blocks():
                self._before[int(block.sequence[0]), int(block.received_ns[0])] = count
                count += len(block)
        for block in self._recording.blocks(between=(received_ns, received_ns + 1)):
            matches = np.flatnonzero((block.sequence == sequence) & (block.received_ns == received_ns))
            if len(matches):
                return self._before[int(block.sequence[0]), int(block.received_ns[0])] + int(matches[0])
        return None


def _with_forces(recording: Recording, stroke: StrokeFinding, block: ReadingBlock, place: str) -> RawReadings:
    """Return readings with the forces that they are, the mean of what came before contact taken off."""
    assert recording.info is not None  # there is a stroke, so there is a transducer
    calibration, rate, onset = recording.info.calibration, recording.info.rate, stroke.onset
    before = np.flatnonzero(block.time < (-np.inf if onset is None else onset))
    free = before[-max(round(MOST_FOR_ZERO * rate), 1) :]
    zero = block.raw[free].mean(axis=0) if len(free) else np.zeros(6)
    words = tr("mean before contact, readings: {count}", count=len(free)) if len(free) else tr("as recorded")
    wrench = in_face_frame(calibration.wrench(block.raw, zero), recording.plan.frame)
    return RawReadings(
        place=place,
        unit=calibration.raw_unit,
        **same_fields(block, RawReadings),
        normal=-wrench[:, 2],
        tangential=np.hypot(wrench[:, 0], wrench[:, 1]),
        zero=words,
    )
