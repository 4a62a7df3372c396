"""Two sessions side by side: a quantity under the other, each stimulus with its two values and the way between them."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

from collections.abc import Sequence

from sessions.report.figures.style import GREEN, GREY, INK, PURPLE, VERMILLION, Panel, sheet, svg

COLOURS = (PURPLE, GREEN, VERMILLION)
Value = float | None


def compared_panel(
    names: Sequence[str],
    sessions: tuple[str, str],
    rows: Sequence[tuple[str, Sequence[tuple[Value, Value]]]],
    *,
    simulated: bool,
) -> Panel | None:
    """Return the picture of `rows`: a stimulus and its values of both sessions for each of `names`.

    None where no stimulus has both.
    """
    if not any(None not in pair for _, pairs in rows for pair in pairs):
        return None
    drawn = sheet(560, 150 * len(names) + 60, tuple(1.0 for _ in names), share_x=True)
    for at, (name, axes) in enumerate(zip(names, drawn.axes, strict=True)):
        for place, (stimulus, pairs) in enumerate(rows):
            first, second = pairs[at]
            if first is not None and second is not None:
                axes.plot([place, place], [first, second], color=GREY, linewidth=1.0)
            for value, filled, session in ((first, False, sessions[0]), (second, True, sessions[1])):
                if value is not None:
                    face = COLOURS[at % len(COLOURS)] if filled else "white"
                    axes.plot(
                        [place],
                        [value],
                        "s" if filled else "o",
                        markersize=5.0,
                        markerfacecolor=face,
                        markeredgecolor=INK,
                        markeredgewidth=0.7,
                        gid=drawn.note(f"{stimulus}, {session}: {name} {value:.4g}"),
                    )
        axes.set_ylabel(name)
        axes.tick_params(labelbottom=axes is drawn.axes[-1])
    drawn.axes[0].set_title(f"circle: {sessions[0]}; filled square: {sessions[1]}")
    last = drawn.axes[-1]
    last.set_xticks(range(len(rows)), [stimulus for stimulus, _ in rows], rotation=60, ha="right")
    last.set_xlim(-0.6, len(rows) - 0.4)
    title = f"{sessions[0]} and {sessions[1]} compared"
    header = ("stimulus", *(f"{name} {part}" for name in names for part in (*sessions, "difference")))
    table = tuple(
        (stimulus, *(cell for a, b in pairs for cell in (a, b, None if a is None or b is None else b - a)))
        for stimulus, pairs in rows
    )
    return Panel("compared", title, svg(drawn, "compared", title, simulated=simulated), header, table)
