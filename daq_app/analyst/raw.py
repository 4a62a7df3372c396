"""The readings of a trial as they were recorded, for a table and for replay."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.analysis.forces import in_face_frame
from sessions.recording import Recording
from sessions.recording.schema import LIVE_FILE, SEALED_FILE
from sessions.report.contents import StrokeFinding

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

    def at(self, time: float) -> int:
        """Return the position of the reading at or just before an instant [s]; 0 where all come later.

        >>> import numpy as np
        >>> none = np.empty(0, np.int64)
        >>> RawReadings("", "", none, none, none, none, np.array([1.0, 2.0]), none, none, none, "").at(1.5)
        0
        """
        return max(int(np.searchsorted(self.time, time, side="right")) - 1, 0)


def raw_readings(recording: Recording, stroke: StrokeFinding) -> RawReadings:
    """Return the readings of the take that holds a stroke, or of a recording without trials those around it."""
    block = recording.readings(stroke.trial)
    assert recording.info is not None  # there is a stroke, so there is a transducer
    calibration, rate, onset = recording.info.calibration, recording.info.rate, stroke.onset
    if stroke.trial is None:
        begin = -np.inf if onset is None else onset - AROUND
        end = np.inf if stroke.lift is None else stroke.lift + AROUND
        block = block.between(*np.searchsorted(block.time, [begin, end]).tolist())
    before = np.flatnonzero(block.time < (-np.inf if onset is None else onset))
    free = before[-max(round(MOST_FOR_ZERO * rate), 1) :]
    zero = block.raw[free].mean(axis=0) if len(free) else np.zeros(6)
    words = f"mean of the {len(free)} readings before contact" if len(free) else "as recorded"
    wrench = in_face_frame(calibration.wrench(block.raw, zero), recording.plan.frame)
    return RawReadings(
        place=_place(recording, block.sequence),
        unit=calibration.raw_unit,
        sequence=block.sequence,
        counter=block.counter,
        status=block.status,
        received_ns=block.received_ns,
        time=block.time,
        raw=block.raw,
        normal=-wrench[:, 2],
        tangential=np.hypot(wrench[:, 0], wrench[:, 1]),
        zero=words,
    )


def _place(recording: Recording, sequence: Whole) -> str:
    """Return file and data set of readings, with the rows they have there."""
    if not len(sequence):
        return f"{recording.folder.name}: no readings"
    before = 0
    for block in recording.blocks():
        found = np.flatnonzero(block.sequence == sequence[0])
        if len(found):
            before += int(found[0])
            break
        before += len(block)
    rows = f"rows {before} to {before + len(sequence) - 1}"
    if (recording.folder / SEALED_FILE).is_file():
        return f"{recording.folder.name}/{SEALED_FILE}, data sets readings/…, {rows}"
    return f"{recording.folder.name}/{LIVE_FILE}, table blocks, {rows}"
