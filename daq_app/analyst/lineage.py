"""The way from a number back to the raw readings, each element a place that can be gone to."""

from dataclasses import dataclass
from typing import Literal

from daq_app.analyst.shown import condition, sed_with_errors
from daq_app.analyst.state import AnalystState, chosen
from daq_app.wording import tr
from sessions.report.contents import StrokeFinding

Place = Literal["session", "trial", "prediction", "friction", "window", "readings"]


@dataclass(frozen=True, slots=True)
class Link:
    """One element of the way: what it says, where it leads, and more of it for who asks."""

    words: str
    place: Place
    more: str = ""


def lineage(state: AnalystState) -> tuple[Link, ...]:
    """Return the way from the chosen trial's SED, or its friction where it has none, to its readings."""
    row = chosen(state)
    if row is None:
        return ()
    links = [Link(state.folder.name, "session", str(state.folder))]
    if row.trial is not None:
        links.append(Link(tr("trial {trial}", trial=row.trial), "trial"))
    said, stroke = row.prediction, row.stroke
    if said is not None and said.sed is not None:
        links.append(
            Link(
                f"SED {condition(state.report, said)} {sed_with_errors(state.report, said)}",
                "prediction",
                tr("averaged over the ending"),
            )
        )
    if stroke is None:
        return tuple(links)
    links.append(_friction(stroke, None if said is None or said.mu is None else (said.mu, said.mu_rule)))
    if stroke.steady is not None:
        begin, end = stroke.steady
        links.append(
            Link(
                tr("steady window {begin:.3f} to {end:.3f} s", begin=begin, end=end),
                "window",
                tr("of stroke {number}, device's clock", number=stroke.number),
            )
        )
    read = state.read
    if read is not None and read.stroke == stroke.number:
        links.append(Link(tr("readings: {count}", count=len(read.readings)), "readings", read.readings.place))
    else:
        links.append(
            Link(tr("raw readings"), "readings", tr("counts, sequence and device counter, as they were recorded"))
        )
    return tuple(links)


def _friction(stroke: StrokeFinding, friction: tuple[float, str] | None) -> Link:
    if friction is not None:
        mu, rule = friction
        tau = "" if stroke.tau_max is None else tr(", τ max {tau_max:.1f} kPa", tau_max=1000.0 * stroke.tau_max)
        return Link(f"µ {mu:.3f}{tau}", "friction", tr("the model was given the {rule}", rule=tr(rule)))
    if stroke.mu_dynamic is None:
        return Link("µ –", "friction", stroke.reasons.get("mu_dynamic", ""))
    return Link(f"µ {stroke.mu_dynamic:.3f}", "friction", tr("mean over the steady window"))
