"""Normal and tangential force over the whole recording, with its strokes."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

from sessions.report import Course, StrokeFinding
from sessions.report.figures.style import GREY, INK, PALE, SKY, VERMILLION, Panel, sheet, svg


def course_panel(course: Course, strokes: tuple[StrokeFinding, ...], *, simulated: bool) -> Panel:
    """Return both forces against time; strokes are grey bands with their number."""
    drawn = sheet(672, 270, (1.0, 1.0), share_x=True)
    upper, lower = drawn.axes
    first, last = (course.time[0], course.time[-1]) if course.time else (0.0, 1.0)
    for axes, values, colour, name in (
        (upper, course.normal, SKY, "normal force"),
        (lower, course.tangential, VERMILLION, "tangential force"),
    ):
        for stroke in strokes:
            begin, end = first if stroke.onset is None else stroke.onset, last if stroke.lift is None else stroke.lift
            text = f"stroke {stroke.number}: {begin:.3f} s to {end:.3f} s"
            axes.axvspan(begin, end, color=PALE, alpha=0.6, linewidth=0, gid=drawn.note(text))
        axes.plot(course.time, values, color=colour, linewidth=0.8)
        axes.axhline(0.0, color=GREY, linewidth=0.4)
        axes.set_ylabel(f"{name}\n[N]")
        axes.set_xlim(first, last if last > first else first + 1.0)
        axes.margins(y=0.08)
    upper.tick_params(labelbottom=False)
    lower.set_xlabel("time on the device's clock [s]")
    for stroke, middle in _numbered(strokes, first, last):
        upper.annotate(
            str(stroke.number),
            xy=(middle, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            va="bottom",
            color=INK,
            fontsize=7.5,
        )
    name, title = "course", "Normal and tangential force over the whole recording"
    header = ("time [s]", "normal force [N]", "tangential force [N]")
    rows = tuple(zip(course.time, course.normal, course.tangential, strict=True))
    return Panel(name, title, svg(drawn, name, title, simulated=simulated), header, rows)


def _numbered(strokes: tuple[StrokeFinding, ...], first: float, last: float) -> list[tuple[StrokeFinding, float]]:
    """Return the strokes whose number has room, each with its middle [s]."""
    room = 0.025 * (last - first)
    kept: list[tuple[StrokeFinding, float]] = []
    for stroke in strokes:
        begin, end = first if stroke.onset is None else stroke.onset, last if stroke.lift is None else stroke.lift
        middle = (begin + end) / 2
        if not kept or middle - kept[-1][1] >= room:
            kept.append((stroke, middle))
    return kept
