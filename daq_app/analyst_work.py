"""What is made of a session for the analyst: first its strokes, then the model's answers; and files of both."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from daq_app.analyst import FINGERS, Found, Message, Step, Write
from daq_app.analyst_process import timed
from sessions.analysis import analyse
from sessions.blinding import revealed
from sessions.exports import ExportError, ExportSource, export, html
from sessions.exports.figures import plates
from sessions.exports.figures.finger import common_levels, finger_panels
from sessions.exports.figures.style import Panel, Plate, in_pixels, look
from sessions.plan import Blinded
from sessions.prediction import predict
from sessions.recording import Recording, RecordingError
from sessions.recording.provenance import software_versions
from sessions.report import findings
from sessions.report.predictions import field_of
from solver.scene import SceneError


class Work:
    """A session, opened, analysed and predicted."""

    def __init__(self, folder: Path, say: Callable[[Message], None]) -> None:
        """Do all of it, and say what is found as soon as it is."""
        self._say = say
        say(Step(0.0, "opening"))
        self._recording = revealed(Recording.open(folder))
        if self._recording.plan.blinded:
            raise Blinded(f"{folder} is blinded: its results are told by index; 'daq-app unblind' opens the key")
        say(Step(0.0, "analysing"))
        self._analysis = analyse(self._recording)
        self._report = findings(self._recording, self._analysis)
        with in_pixels() as pixels:
            drawn = plates(self._report)
        say(Found("analysed", self._report, drawn, pixels))
        self._prediction = predict(self._analysis, self._recording.plan, progress=timed(say, "predicting"))
        self._report = findings(self._recording, self._analysis, self._prediction)
        say(Step(1.0, "drawing"))
        with in_pixels() as pixels:
            drawn = plates(self._report)
        say(Found("drawing", self._report, drawn, pixels))
        every = tuple(
            field
            for row in self._prediction.trials
            if row.block is not None and (field := field_of(row.block, row)) is not None
        )
        said = timed(say, "drawing every finger")
        fingers: list[Panel] = []
        with look(), in_pixels() as more:
            levels = common_levels(every) if every else ()
            for number, field in enumerate(every):
                said(number / len(every))
                fingers += finger_panels(field, levels, simulated=self._report.simulated)
        others = tuple(plate for plate in drawn if plate.name != FINGERS)
        plate = Plate(FINGERS, "The finger of every trial; one scale of colours for all.", tuple(fingers))
        say(Found("predicted", replace(self._report, fields=every), (*others, plate), {**pixels, **more}))

    def write(self, asked: Write) -> str:
        """Write the report or an export, and return where it is."""
        path = Path(asked.path)
        if asked.what == "report":
            html.write_report(self._report, path)
            return str(path)
        made_by = {"made_by": software_versions()}
        source = ExportSource(self._recording, made_by | self._analysis.to_dict(), made_by | self._prediction.to_dict())
        told = timed(self._say, f"writing {asked.what}")

        def shown(part: float) -> None:
            told(part)

        return str(export(source, asked.what, path, shown))


def sentence_of(error: Exception) -> str:
    """Return a failure in a sentence."""
    known = (RecordingError, ExportError, Blinded, SceneError, html.ReportError)
    return str(error) if isinstance(error, known) else f"{type(error).__name__}: {error}"
