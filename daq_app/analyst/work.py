"""The work on a session for the analyst: first its strokes, then the model's answers, then requests."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from daq_app.analyst import state as m
from daq_app.analyst.finger_words import MEAN_PANELS, compare_reports, film_text, name_and_errors
from daq_app.analyst.frame import FIELD_ERRORS, Film, Frame, FrameMesh, Instant
from daq_app.analyst.session_words import picture_errors, sed_text
from daq_app.analyst.stroke import RawFile, decision_of, effective_decision, history, reversal
from daq_app.batch.derived import PREDICTION, analysis_document, stored_document, stored_options, stored_settings
from daq_app.console import is_ours
from daq_app.wording import tr
from drivers.arrays import Array
from sessions.exchange import ExportSource, export
from sessions.file_access import failure_sentence, write_whole
from sessions.plan.plan import Blinded
from sessions.prediction import PredictionOptions, SessionPrediction, TrialPrediction, predict
from sessions.prediction.scenes import SolutionPath
from sessions.prediction.uncertainty import with_intervals
from sessions.recording import Recording
from sessions.recording.derived import reveal
from sessions.recording.head import software_versions
from sessions.recording.manifest import seal_differences
from sessions.report import Further, findings
from sessions.report.contents import Field, Report
from sessions.report.trials import field_of, finding_of
from sessions.strokes import analyse
from sessions.strokes.decisions import append, read
from solver import Cancelled, Prediction, Scene
from solver.equilibrium.load_path import Instant as Step
from solver.mesh import Mesh
from solver.prediction import Skin
from solver.response.fields import Fields, Sketch, Still, fields_of, path_until_failure, place_of_least_stretch, stills

if TYPE_CHECKING:
    from sessions.report.figures import Panel

Send = Callable[[m.Reply], None]
Progress = Callable[[float], bool]
Urgent = Callable[[], bool]  # whether the current work must stop for another request
_MOST = 150  # states shown of a load path without full slip, which may be long
AT_ONCE = 8  # states drawn between two reports of progress


class Work:
    """An open, analysed session; `go_on` computes the model's answers."""

    def __init__(self, folder: Path, send: Send, urgent: Urgent = lambda: False) -> None:
        """Open and analyse the session in `folder`, and send the results."""
        self._send, self._urgent = send, urgent
        send(m.Step(0.0, tr("opening")))
        self._recording = _open_recording(folder)
        self._raw = RawFile(self._recording)
        self._row = 0
        self._load_paths: dict[m.Key, tuple[TrialPrediction, SolutionPath | None]] = {}  # no load path at finite strain
        self._sketches: dict[int, Sketch] = {}
        self._prediction: SessionPrediction | None = None
        self._comparison: Report | None = None  # of the compared session
        self._history: m.FingerHistory | None = None  # the last history
        self._analyse()

    @property
    def unfinished(self) -> bool:
        """Say whether answers to the present strokes are missing."""
        return self._prediction is None

    def go_on(self) -> None:
        """Compute the model's answers, the chosen trial first. Raises Cancelled, and keeps the answers so far."""
        options, progress = _options(self._recording), self.progress_listener(tr("predicting"))
        plan, first = self._recording.plan, self._first()
        self._prediction = predict(self._analysis, plan, options, progress, self._take_answer, first)
        self._report = findings(self._recording, self._analysis, self._prediction)
        self._send(m.ReportReady("predicted", self._report, history(read(self._recording.folder))))

    def do(self, request: m.Ask) -> None:
        """Carry out a request and send the result. Raises Cancelled, and errors that `sentence_of` describes."""
        match request:
            case m.Choose(row):
                self._row = row
            case m.Move():
                self._move(request)
            case m.Undo(author, redo):
                self._undo(author, redo=redo)
            case m.Draw(name):
                self._draw(name)
            case m.ShowHistory(key):
                self._film(key)
            case m.ShowReadings(stroke):
                self._send(m.Excerpt(stroke, self._raw.around(self._report.strokes[stroke - 1])))
            case m.Compare(folder):
                self._compare(Path(folder))
            case m.Write():
                self._send(m.Done(tr("Written: {path}", path=self._write(request))))

    def progress_listener(self, activity: str, load_steps: int = 0) -> Callable[[float], bool]:
        """Return a progress callback that reports fraction done and time left; it returns False for urgent requests."""
        start = last_report = time.monotonic()

        def report_part(fraction: float) -> bool:
            nonlocal last_report
            now = time.monotonic()
            if now - last_report > 0.05:
                last_report, elapsed_s = now, now - start
                remaining_s = elapsed_s * (1.0 - fraction) / fraction if fraction > 0.05 and elapsed_s > 1.0 else None
                self._send(m.Step(fraction, activity, remaining_s, load_steps))
            return not self._urgent()

        return report_part

    def _analyse(self) -> None:
        self._send(m.Step(0.0, tr("analysing")))
        self._analysis = analyse(self._recording, stored_settings(self._recording))
        self._prediction = None
        self._report = findings(self._recording, self._analysis)
        self._send(m.ReportReady("analysed", self._report, history(read(self._recording.folder))))

    def _move(self, request: m.Move) -> None:
        stroke = self._report.strokes[request.stroke - 1]
        decision = decision_of(stroke, request.edge, request.time, request.author, request.reason)
        record = append(self._recording, decision)
        self._analyse()
        self._send(m.Done(tr("Recorded: {sentence}", sentence=record.sentence)))

    def _undo(self, author: str, *, redo: bool) -> None:
        decisions = read(self._recording.folder)
        line = reversal(decisions, author, redo=redo)
        if line is None:
            raise NothingToShow(tr("There is nothing to redo.") if redo else tr("There is no decision to undo."))
        record = append(self._recording, line)
        self._analyse()
        act, sentence = tr("Redone") if redo else tr("Undone"), effective_decision(decisions, line).sentence
        message = tr("{act}, as decision {number}: {sentence}", act=act, number=record.number, sentence=sentence)
        self._send(m.Done(message))

    def _first(self) -> int | None:
        strokes = self._report.strokes
        if not self._row < len(strokes):
            return None
        stroke, plan = strokes[self._row], self._recording.plan
        if not plan.blocks:
            return self._row
        main = [trial.number for block in plan.blocks if block.phase == "main" for trial in block.trials]
        return main.index(stroke.trial) if stroke.trial in main else None

    def _take_answer(self, _number: int, row: TrialPrediction, load_path: SolutionPath | None) -> None:
        finding = finding_of(row)
        self._load_paths[finding.trial, finding.stroke] = row, load_path
        self._send(m.TrialAnswer(finding, self._finger(row.prediction)))

    def _finger(self, prediction: Prediction | None) -> Frame | None:
        if prediction is None:
            return None
        sketch = self._sketch(prediction.mesh, prediction.scene)
        return _frame(_frame_mesh(sketch), fields_of(prediction, sketch), prediction.skin, prediction.row.sed)

    def _sketch(self, mesh: Mesh, scene: Scene) -> Sketch:
        if id(mesh) not in self._sketches:
            self._sketches = {id(mesh): Sketch.of(mesh, scene)}
        return self._sketches[id(mesh)]

    def _draw(self, name: str) -> None:
        self._send(m.Step(0.0, tr("drawing")))
        panel, png = self._panel(name)
        self._send(m.SessionPicture(name, "" if panel is None else panel.title, png))

    def _panel(self, name: str, note: str = "") -> "tuple[Panel | None, bytes]":
        """Return a picture with a `note` below it, and its PNG; `session_pictures` names those of the session."""
        from sessions.report.figures import picture  # slow to load, and often not needed
        from sessions.report.figures.finger import common_levels, finger_panels
        from sessions.report.figures.style import in_pixels, look

        picture_kind, _, subject = name.partition(" ")
        report, panel = self._report, None
        with in_pixels(note) as pixels:
            if picture_kind in ("finger", "contact"):
                every = self._fields()
                if (field := self._field(subject, every)) is not None:
                    with look(simulated=report.simulated):
                        levels = common_levels(tuple(every.values()) or (field,))
                        panel = finger_panels(field, levels)[picture_kind == "contact"]
            elif picture_kind == "compared":
                panel = self._comparison_panel()
            elif picture_kind == "stroke":
                only = tuple(stroke for stroke in report.strokes if stroke.number == int(subject))
                panel = picture(replace(report, strokes=only), "friction")
            else:
                panel = picture(report, picture_kind, subject or None)
        return panel, b"" if panel is None else pixels[panel.name]

    def _note(self, name: str) -> str:
        """Return the note below a saved picture: the condition and the errors of its SEDs."""
        picture_kind, _, subject = name.partition(" ")
        if picture_kind in ("finger", "contact"):
            stroke, _, step = subject.partition(" ")
            answers = (finding_of(row) for (_, number), (row, _) in self._load_paths.items() if number == int(stroke))
            sentences = (sed_text(self._report, answer) for answer in answers if answer.sed is not None)
            caption = film_text(self._history, int(step)) if step else next(sentences, "")
            return f"{caption}. {tr(FIELD_ERRORS)}"
        if picture_kind == "compared":
            return "\n".join(map(name_and_errors, filter(None, (self._report, self._comparison))))
        return picture_errors(self._report, name)

    def _field(self, subject: str, every: Mapping[int, Field]) -> Field | None:
        """Return the finger of a stroke, in full slip or at a step of the last drawn history."""
        stroke, _, step = subject.partition(" ")
        if not step:
            return every.get(int(stroke))
        film = self._history
        if film is None or film.key[1] != int(stroke):
            return None
        finding = self._report.strokes[int(stroke) - 1]
        if finding.index is None:  # a picture for paper must name its stimulus
            return None
        frame = film.film.frames[int(step)]
        fields = Fields(frame.nodes, frame.mesh.triangles, frame.values, frame.outlines, frame.patch)
        return Field(finding.experiment, finding.index, fields, frame.contact)

    def _comparison_panel(self) -> "Panel | None":
        from sessions.report.figures.relation import comparison_panel
        from sessions.report.figures.style import look

        if (comparison := self._comparison) is None:
            return None
        names, simulated = (self._report.session, comparison.session), self._report.simulated or comparison.simulated
        with look(simulated=simulated):
            return comparison_panel(MEAN_PANELS, names, compare_reports(self._report, comparison))

    def _fields(self) -> dict[int, Field]:
        """Return the finger of every answered trial, by the number of its stroke."""
        pairs = ((stroke, field_of(row.block or "", row)) for (_, stroke), (row, _) in self._load_paths.items())
        return {stroke: field for stroke, field in pairs if field is not None and stroke is not None}

    def _film(self, key: m.Key) -> None:
        entry = self._load_paths.get(key)
        if entry is None:
            raise NothingToShow(tr("The model has no load path to show for this trial: it was not solved."))
        prediction, load_path = entry
        if load_path is None:
            raise NothingToShow(prediction.reasons.get("sed") or tr("A history is drawn at small strain only."))
        if load_path.march is None and (prediction.prediction is not None or load_path.scene.materials.relax):
            raise NothingToShow(tr("The load path of tissues that relax has no stored states to draw."))
        sketch, reason = self._sketch(load_path.finger.geometry.mesh, load_path.scene), ""
        progress = self.progress_listener(tr("drawing the history"), len(load_path.march or ()))
        if load_path.march is not None:
            film = film_of(load_path, load_path.march, sketch, progress)
        else:
            film, stop = lost_film(load_path, sketch, progress)
            reason = prediction.reasons.get("sed", "")
            reason = tr("{first} Followed from first touch: {why}", first=reason, why=stop) if stop else reason
        self._history = m.FingerHistory(key, film, reason)
        self._send(self._history)

    def _compare(self, folder: Path) -> None:
        self._send(m.Step(0.0, tr("opening {name}", name=folder.name)))
        recording = _open_recording(folder)
        analysis = analyse(recording, stored_settings(recording))
        progress = self.progress_listener(tr("predicting {name}", name=folder.name))
        fingers: dict[m.Key, Frame] = {}

        def take_answer(_number: int, row: TrialPrediction, _load_path: SolutionPath | None) -> None:
            if (finger := self._finger(row.prediction)) is not None:
                finding = finding_of(row)
                fingers[finding.trial, finding.stroke] = finger

        prediction = predict(analysis, recording.plan, _options(recording), progress=progress, watch=take_answer)
        self._comparison = findings(recording, analysis, prediction)
        self._send(m.OtherSession(self._comparison, fingers))

    def _write(self, request: m.Write) -> str:
        """Write the report, a picture or an export, and return its path."""
        path = Path(request.path)
        if request.document.startswith("picture "):
            return self._write_picture(request.document.removeprefix("picture "), path)
        self._send(m.Step(0.0, tr("writing {what}", what=request.document)))
        if self._prediction is None:
            self.go_on()
        assert self._prediction is not None  # it has just been computed
        if request.document == "report":
            from sessions.report import pages

            progress = self.progress_listener(tr("carrying the uncertainty of friction through"))
            with_them = replace(self._prediction, options=replace(self._prediction.options, intervals=True))
            self._prediction = with_intervals(with_them, progress)
            further = Further(seal_differences=seal_differences(self._recording))
            pages.write_report(findings(self._recording, self._analysis, self._prediction, further=further), path)
            return str(path)
        made_by = {"made_by": software_versions()}
        documents = made_by | analysis_document(self._analysis), made_by | self._prediction.to_dict()
        source = ExportSource(self._recording, *documents)
        progress = self.progress_listener(tr("writing {what}", what=request.document))

        def report_part(fraction: float) -> None:
            if not progress(fraction):
                raise Cancelled

        return str(export(source, request.document, path, report_part))

    def _write_picture(self, name: str, path: Path) -> str:
        from sessions.report.pages import panel_csv, swap_in

        self._send(m.Step(0.0, tr("writing {name}", name=path.name)))
        note = self._note(name)
        panel, png = self._panel(name, note)
        if panel is None:
            raise NothingToShow(tr("There are no numbers for this picture."))
        if (suffix := path.suffix.lower()) in (".svg", ".csv"):
            heading = " · ".join(filter(None, (self._report.head, note)))
            swap_in(path, panel.svg if suffix == ".svg" else panel_csv(panel, heading))
        else:
            write_whole(path, png)
        return str(path)


class NothingToShow(Exception):
    """There is nothing to show or save for a request; the message says why."""


def _open_recording(folder: Path) -> Recording:
    recording = reveal(Recording.open(folder))
    if recording.plan.blinded:
        raise Blinded(f"{folder} is blinded: its results are shown by index; 'daq-app unblind' opens the key")
    return recording


def _options(recording: Recording) -> PredictionOptions:
    """Return the options of the kept prediction, or the defaults, without the parts that this window does not show.

    Raises RecordingError if that prediction is damaged: default options would give another one.
    """
    stored_document(recording.folder, PREDICTION)
    return replace(stored_options(recording), intervals=False, variants="none", variant_intervals=False)


def sentence_of(error: Exception) -> str:
    """Return a sentence that describes a failure."""
    if isinstance(error, OSError):
        return failure_sentence(error)
    return str(error) if is_ours(type(error).__module__) else f"{type(error).__name__}: {error}"


def _frame_mesh(sketch: Sketch) -> FrameMesh:
    return FrameMesh(sketch.triangles, sketch.elements, sketch.region, sketch.skin)


def film_of(load_path: SolutionPath, instants: Sequence[Step], sketch: Sketch, progress: Progress) -> Film:
    """Return the states of a load path. Raises Cancelled if `progress` returns False."""
    pictures: list[Still] = []
    for begin in range(0, len(instants), AT_ONCE):
        pictures += stills(load_path.finger, instants[begin : begin + AT_ONCE], sketch)
        if not progress(min(1.0, (begin + AT_ONCE) / len(instants))):
            raise Cancelled
    mesh = _frame_mesh(sketch)
    frames = tuple(_frame(mesh, still.fields, still.skin, still.row) for still in pictures)
    return Film(frames, tuple(_instant(still) for still in pictures))


def lost_film(load_path: SolutionPath, sketch: Sketch, progress: Progress) -> tuple[Film, str]:
    """Return the states up to the failure of a solve without an answer, and the reason for it."""
    instants, failure = path_until_failure(load_path.scene, load_path.finger, progress)
    every = max(1, -(-len(instants) // _MOST))
    film = film_of(load_path, [*instants[:-1:every], instants[-1]], sketch, progress)
    if failure is None:
        return film, ""
    lost = place_of_least_stretch(load_path.finger, instants[-1].state, instants[-1].depth)
    return replace(film, lost=lost), str(failure.in_a_sentence())


def _frame(mesh: FrameMesh, fields: Fields, skin: Skin, row: Array) -> Frame:
    return Frame(mesh, fields.nodes, fields.values, fields.outlines, fields.patch, skin, row)


def _instant(still: Still) -> Instant:
    instant, states = still.instant, still.skin.state
    sticking, slipping = states.count("stick"), states.count("slip") + states.count("cap")
    return Instant(instant.time, instant.depth, instant.travel, still.sed, sticking, slipping)
