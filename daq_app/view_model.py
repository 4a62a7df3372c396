"""What is said of the live model: a sentence, and the SED over the last seconds. No Qt."""

from collections import deque
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daq_app.live_model import Provisional, Settled
from daq_app.live_trace import GAP, LONGEST, Columns

Array = NDArray[np.float64]

CHANNELS = ("SED",)
KINEMATICS = {"small": "small strain", "finite": "finite strain"}


@dataclass(frozen=True, slots=True)
class ModelWords:
    """A line over the picture."""

    words: str
    state: Literal["none", "provisional", "beyond", "settled"]


def model_words(said: Provisional | None, settled: Settled | None, problem: str) -> ModelWords:
    """Return what is said of the picture that is shown."""
    if problem:
        return ModelWords(f"No live model: {problem}.", "none")
    if settled is not None:
        return ModelWords(_of_settled(settled), "settled")
    if said is None:
        return ModelWords("The live model is starting.", "none")
    how = KINEMATICS[said.kinematics]
    if said.beyond:
        return ModelWords(f"These forces are beyond the reach of the model at {how}.", "beyond")
    if said.sed[-1] <= 0.0:
        return ModelWords("Model: nothing touches.", "none")
    return ModelWords(f"PROVISIONAL  SED {_kpa(float(said.sed[-1]))} · {said.depth:.1f} mm deep · {how}", "provisional")


def _of_settled(settled: Settled) -> str:
    shown = "" if settled.provisional is None else f" · shown live {_kpa(settled.provisional)}"
    if settled.sed is None:
        return f"No full solve: {settled.reason}{shown}"
    error = "" if settled.error is None else f" ± {100 * settled.error:.1f} %"
    by = settled.difference
    if by is not None:
        shown += f" ({100 * by:+.1f} %)".replace("-", "−")
    return f"Full solve  SED {_kpa(settled.sed)}{error}{shown}"


def _kpa(sed: float) -> str:
    return f"{1000 * sed:.2f} kPa"


class ModelTrace:
    """The SED at the receptor over the last minute, for a plot."""

    def __init__(self) -> None:
        """Start with nothing."""
        self._said: deque[Provisional] = deque()

    def add(self, said: Provisional) -> None:
        """Take another prediction."""
        if self._said and self._said[-1].stream != said.stream:
            self._said.clear()
        self._said.append(said)
        while said.time[-1] - self._said[0].time[-1] > LONGEST:
            self._said.popleft()

    def columns(self, first: float, last: float) -> Columns:
        """Return the SED [kPa] from `first` to `last` [s, device time]; a gap stays a gap."""
        near = [said for said in self._said if said.time[-1] >= first and said.time[0] <= last]
        if not near:
            return Columns(np.empty(0), np.empty((1, 0)))
        time = np.concatenate([said.time for said in near])
        sed = 1000.0 * np.concatenate([said.sed for said in near])
        gaps = np.flatnonzero(np.diff(time) > GAP * 0.02) + 1
        return Columns(np.insert(time, gaps, time[gaps]), np.insert(sed, gaps, np.nan)[None])
