"""Predicted response of the receptor in the course of the strokes."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

from collections.abc import Sequence

from sessions.report import PredictionFinding
from sessions.report.figures.labels import Label, label_right
from sessions.report.figures.style import GREEN, GREY, Panel, shades, sheet, svg

PRESSED = 1.0  # the model presses for 1 s, then slides [s]


def response_panel(predictions: Sequence[PredictionFinding], name: str, *, simulated: bool) -> Panel | None:
    """Return SED against time: the whole course above, sliding alone on its own scale below."""
    courses = sorted(
        ((p, p.history) for p in predictions if p.history is not None),
        key=lambda c: (c[0].index is None, c[0].index or 0, c[0].stroke or 0),
    )
    if not courses:
        return None
    drawn = sheet(328, 420, (1.0, 1.25))
    whole, sliding = drawn.axes
    labels: list[Label] = []
    rows: list[tuple[int | None, int | None, float, float]] = []
    seen: list[float] = []
    kind = "stroke" if courses[0][0].index is None else "index"
    end = max(history.time[-1] for _, history in courses)
    for (prediction, history), shade in zip(courses, shades(GREEN, len(courses)), strict=True):
        kilopascal = [1e3 * value for value in history.sed]
        label = str(prediction.stroke if prediction.index is None else prediction.index)
        text = f"{kind} {label}: {kilopascal[-1]:.3f} kPa in the end"
        for axes in drawn.axes:
            axes.plot(history.time, kilopascal, color=shade, linewidth=1.2, gid=drawn.note(text))
            if history.time[-1] < end:  # settled: it stays
                axes.plot(
                    [history.time[-1], end], [kilopascal[-1]] * 2, color=shade, linewidth=0.8, linestyle=(0, (2, 2))
                )
        labels.append(Label(label, end, kilopascal[-1]))
        rows += [(prediction.trial, prediction.index, t, v) for t, v in zip(history.time, history.sed, strict=True)]
        seen += [v for t, v in zip(history.time, kilopascal, strict=True) if t >= PRESSED]
    whole.axvline(PRESSED, color=GREY, linewidth=0.5, linestyle=(0, (2, 3)))
    whole.set_ylim(0.0, 1.25 * max(row[3] for row in rows) * 1e3)
    for text, offset, side in (("pressing", -4, "right"), ("sliding", 4, "left")):
        whole.annotate(
            text,
            xy=(PRESSED, 0.98),
            xycoords=("data", "axes fraction"),
            xytext=(offset, 0),
            textcoords="offset points",
            ha=side,
            va="top",
            color=GREY,
        )
    whole.set_title(name)
    sliding.set_xlim(PRESSED, end)
    margin = 0.06 * (max(seen) - min(seen) or max(seen))
    sliding.set_ylim(min(seen) - margin, max(seen) + margin)
    whole.set_xlim(0.0, end)
    whole.set_ylabel("SED [kPa]")
    sliding.set_ylabel("SED while sliding [kPa]")
    sliding.set_xlabel("time [s]")
    label_right(drawn, sliding, labels, kind)
    title = f"Predicted response in time, {name or 'all strokes'}"
    name = f"response-{name}" if name else "response"
    header = ("trial", "index", "time [s]", "SED [MPa]")
    return Panel(name, title, svg(drawn, name, title, simulated=simulated), header, tuple(rows))
