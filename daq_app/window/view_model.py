"""What is said of the live model: a sentence, and the SED over the last seconds. No Qt."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from daq_app.window.live_model import STEP, Provisional, Settled
from daq_app.window.live_trace import Columns, LiveTrace
from daq_app.wording import errors_words, tr, tr_noop

GAP = 0.1  # predictions further apart have a gap between them [s]
CHANNELS = ("SED", "SED instead")  # the latter at small strain, where finite strain is asked for and out of reach
KINEMATICS = {"small": tr_noop("small strain"), "finite": tr_noop("finite strain")}


@dataclass(frozen=True, slots=True)
class ModelWords:
    """A line over the picture."""

    words: str
    state: Literal["none", "provisional", "instead", "beyond", "failed", "settled"]


def model_words(said: Provisional | None, settled: Settled | None, problem: str) -> ModelWords:
    """Return what is said of the picture that is shown."""
    if problem:
        return ModelWords(tr("No live model: {problem}.", problem=problem), "none")
    if settled is not None:
        return ModelWords(_of_settled(settled), "failed" if settled.sed is None else "settled")
    if said is None:
        return ModelWords(tr("The live model is starting."), "none")
    if said.beyond:
        return ModelWords(tr("These forces are beyond the reach of the model."), "beyond")
    if said.sed[-1] <= 0.0:
        return ModelWords(
            tr("Model at {kinematics}: nothing touches.", kinematics=tr(KINEMATICS[said.kinematics])), "none"
        )
    known = tr(
        "PROVISIONAL  SED {kpa}{errors} · at the measured force, {depth:.1f} mm deep · ",
        kpa=_kpa(float(said.sed[-1])),
        errors=errors_words(None),
        depth=said.depth,
    )
    if said.instead[-1]:
        return ModelWords(
            tr("{told}small strain: these forces are beyond the reach of finite strain", told=known), "instead"
        )
    return ModelWords(known + tr(KINEMATICS[said.kinematics]), "provisional")


def _of_settled(settled: Settled) -> str:
    shown = "" if settled.provisional is None else tr(" · shown live {kpa}", kpa=_kpa(settled.provisional))
    how = tr(KINEMATICS[settled.kinematics])
    if settled.sed is None:
        kept = ""
        if settled.depth is not None:
            lost = settled.picture is not None and settled.picture.lost is not None
            marked = tr("; ⊗ marks its most squeezed tissue") if lost else ""
            kept = tr(
                " Shown is the last state that was followed, {depth:.1f} mm deep{marked}.",
                depth=settled.depth,
                marked=marked,
            )
        return tr(
            "No full solve at {how}{shown}. {reason}{kept}", how=how, shown=shown, reason=settled.reason, kept=kept
        )
    by = settled.difference
    if by is not None:
        shown += f" ({100 * by:+.1f} %)".replace("-", "−")
    return tr(
        "Full solve  SED {kpa}{errors} · at the measured force, {how}{shown}",
        kpa=_kpa(settled.sed),
        errors=errors_words(settled.error, settled.effect),
        how=how,
        shown=shown,
    )


def _kpa(sed: float) -> str:
    return f"{1000 * sed:.2f} kPa"


class ModelTrace:
    """The SED at the receptor over the last minute, for a plot."""

    def __init__(self) -> None:
        self._trace = LiveTrace(1.0 / STEP, channels=len(CHANNELS), gap=GAP)
        self._stream: int | None = None

    def add(self, said: Provisional) -> None:
        """Take another prediction."""
        if said.stream != self._stream:
            self._stream = said.stream
            self._trace.clear()
        sed = 1000.0 * said.sed
        self._trace.add(said.time, np.stack([np.where(said.instead, np.nan, sed), np.where(said.instead, sed, np.nan)]))

    def holds(self, first: float) -> bool:
        """Return whether nothing said since `first` [s] was dropped."""
        return self._trace.holds(first)

    def columns(self, first: float, last: float, count: int) -> Columns:
        """Return the SED [kPa] from `first` to `last` [s, device time] in about `count` columns; a gap stays a gap."""
        return self._trace.columns(first, last, count)
