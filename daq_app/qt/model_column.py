"""What the model says of the chosen trial: its finger, its history, the pictures of the session, another session."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QTabWidget, QWidget

from daq_app.analyst import state as m
from daq_app.analyst.finger_words import (
    common_range,
    compare_reports,
    film_words,
    finger_words,
    name_and_errors,
    other_finger,
    visible_film,
    was_tried,
)
from daq_app.analyst.frame import FIELD_ERRORS, Finger, automatic_range
from daq_app.analyst.session_words import picture_errors, scene_table, session_pictures
from daq_app.analyst.state import AnalystState, Row, selected_row
from daq_app.qt.finger_canvas import NO_PARTS, FingerCanvas
from daq_app.qt.finger_painter import Look
from daq_app.qt.parts import WrappedLabel, button, choice, hbox, vbox
from daq_app.qt.pictures import (
    COMPARISON_NAME,
    FILM_SUFFIXES,
    ComparedView,
    PictureView,
    SaveButtons,
    write_film,
    write_picture,
)
from daq_app.qt.plots import LINE, OWN, FieldBar, FieldPlot
from daq_app.qt.tables import TextTable
from daq_app.qt.tokens import Tokens
from daq_app.qt.transport_bar import TransportBar
from daq_app.wording import tr
from solver.quantities import SED

FINGER, SESSION, _COMPARISON = range(3)  # tabs
STEPS_A_SECOND = 10.0  # of a history that plays: it counts steps, for pressing takes long and sliding little time


class ModelColumn(QWidget):
    """Four tabs: the finger, pictures of the session, another session, and the scene."""

    def __init__(
        self, tokens: Tokens, ask: Callable[[m.Ask], None], compare: Callable[[], None], say: Callable[[str], None]
    ) -> None:
        """Show nothing; `ask` orders work, `compare` chooses another session, `say` takes what came of a saved file."""
        super().__init__()
        self._ask, self._say = ask, say
        self._state: AnalystState | None = None
        self._film: m.FingerHistory | None = None
        self._name = ""  # of the finger's pictures, after their kind
        self._picture_request = ("", -1)  # picture that was asked for, and version of the report
        self._history_request: tuple[m.Key, int] | None = None  # of a trial without an answer, and version
        self._at: int | None = None  # of the film; None: the settled state
        self.finger = FingerCanvas(tokens)
        self.other = FingerCanvas(tokens, self.finger.sight)  # of the session that is compared
        self.other.hide()
        self.fields, self.plot = FieldBar(), FieldPlot(tokens)
        self.probe, self.errors = WrappedLabel("quiet", keeps_room=True), WrappedLabel("quiet")
        self.fields.changed.connect(self._paint)
        self.plot.changed.connect(self._paint)
        self.plot.draw.toggled.connect(self._draw_line)
        self.finger.sight.pointed.connect(self._probe)
        self.finger.sight.cut.connect(self._cut)
        for canvas in (self.finger, self.other):
            canvas.range_chosen.connect(self.fields.fix)
        texts = {
            tr("Contact"): tr("show the contact alone, with its tractions"),
            tr("Mesh"): tr("show the mesh"),
            tr("Both"): tr("show the finger of the compared session beside this one"),
        }
        buttons = (button(text, name, self._paint, "small", checkable=True) for text, name in texts.items())
        self.near, self.mesh, self.together = buttons
        self.together.hide()
        self.history = button(tr("History"), tr("show the finger from first touch on"), self._ask_history, "small")
        self.film = button(tr("Film"), tr("save the history as a film, GIF or MP4"), self._ask_film, "small")
        self._filming = False
        self.save = SaveButtons(tr("the finger"), self._save_finger)
        self.player = TransportBar(tr("the history"), tells_time=False)
        self.player.moved.connect(self._show_step)
        self.why = WrappedLabel("value", "look")
        self.errors.show_text(tr(FIELD_ERRORS))
        self.which, self.picture = choice(tr("picture of the session")), PictureView(tr("the picture"), self._save)
        self.which.activated.connect(self._show_picture)
        self.session_errors = WrappedLabel("quiet")
        self.comparison = ComparedView(compare, self._save)
        self.scene = TextTable(tr("scene and model"), (tr("of the model"), tr("value"), tr("remark")))
        session = QWidget()
        vbox(self.which, self.session_errors, (self.picture, 1), on=session)
        self.tabs = QTabWidget()
        self.tabs.setAccessibleName(tr("pictures"))
        self.tabs.addTab(self._finger_page(), tr("Finger"))
        self.tabs.addTab(session, tr("Session"))
        self.tabs.addTab(self.comparison, tr("Comparison"))
        self.tabs.addTab(self.scene, tr("Scene"))
        self.tabs.currentChanged.connect(self._show_picture)
        vbox(self.tabs, on=self)

    def show_state(self, state: AnalystState) -> None:
        before, self._state = self._state, state
        film = visible_film(state)
        if film is not self._film:
            self._film = film
            self._at = None if film is None else len(film.film.instants) - 1
            count = 0 if film is None else len(film.film.instants)
            self.player.set_times([number / STEPS_A_SECOND for number in range(count)], max(count - 1, 0))
        row = selected_row(state)
        prediction, stroke = (None, None) if row is None else (row.prediction, row.stroke)
        self.history.setEnabled(film is None and prediction is not None and prediction.mu is not None)
        self.why.show_text(film_words(film))
        if film is None:
            self._ask_where(row, state.version)
        drawable = film is not None or (row is not None and row.key in state.fingers)
        self._name = f" {stroke.number}" if drawable and stroke is not None else ""
        self.together.setVisible(state.other is not None)
        self._paint()
        self.scene.show_lines(scene_table(state))
        if before is None or before.version != state.version or before.report is None:
            names = [words for _, words in session_pictures(state.report)]
            if names != [self.which.itemText(i) for i in range(self.which.count())]:
                self.which.clear()
                self.which.addItems(names)
        if (other := state.other) is not None and state.report is not None:
            names = (name_and_errors(state.report), name_and_errors(other.report))
            self.comparison.show_rows(compare_reports(state.report, other.report), names)
            if before is None or before.other is not other:
                self._picture_request = ("", -1)
                self.together.setChecked(True)
                self._paint()
                self.tabs.setCurrentIndex(_COMPARISON)
        self._show_picture()

    def _show_picture(self, *_: object) -> None:
        """Show the picture of the tab; what is not drawn is asked for only when it is looked at."""
        state, tab, which = self._state, self.tabs.currentIndex(), self.which.currentIndex()
        if state is None:
            return
        if tab == _COMPARISON and state.other is not None:
            view, name, words = self.comparison.picture, COMPARISON_NAME, tr("both sessions")
        elif tab == SESSION and 0 <= which < len(names := session_pictures(state.report)):
            view, (name, words) = self.picture, names[which]
            self.session_errors.show_text(picture_errors(state.report, name))
        else:
            return
        picture = state.pictures.get(name)
        if picture is not None:
            title = picture.title or tr("There are no numbers yet for: {words}", words=words)
            view.show_picture(name, title, picture.png)
            return
        view.show_picture("", tr("Drawing: {words}", words=words), b"")
        if self._picture_request != (name, state.version):
            self._picture_request = (name, state.version)
            self._ask(m.Draw(name))

    def _paint(self) -> None:
        state = self._state
        row = None if state is None else selected_row(state)
        film, at = self._film, self._at
        if film is not None and at is not None:
            finger, words = Finger(film.film.parts, film.film.frames[at], film.film.arcs), film_words(film, at)
        else:
            finger = None if state is None or row is None else state.fingers.get(row.key)
            words = finger_words(state)
        other, other_words = other_finger(state) if self.together.isChecked() else (None, "")
        lost = film.film.lost if film is not None and at == len(film.film.frames) - 1 else None
        field = self.fields.field
        present = tuple(one.frame for one in (finger, other) if one is not None)
        frames = tuple(film.film.frames) if film is not None and self._filming else present
        own = automatic_range(field, frames)  # of a film that is written: the same for all of it
        common = common_range(state, field)
        ends = own if self.fields.mode == OWN or (lost and own[1] > common[1]) else common
        look = Look(field, self.fields.range(ends), self.near.isChecked(), self.mesh.isChecked(), lost)
        pair = ((self.finger, finger, f"A  {words}"), (self.other, other, f"B  {other_words}"))
        panels = pair if other_words else ((self.finger, finger, words),)
        self.finger.sight.words = tuple(caption for _, _, caption in panels)
        for canvas, one, caption in panels:
            frame, parts = (None, NO_PARTS) if one is None else (one.frame, one.parts)
            canvas.show_frame(
                frame, parts, caption, look if canvas is self.finger else replace(look, lost=None), present
            )
        self.other.setVisible(bool(other_words))
        self.plot.show_field((finger, other) if other_words else (finger,), field, self.finger.sight.line)
        kind = "contact" if self.near.isChecked() else "finger"
        self.film.setEnabled(bool(self._name) and film is not None)
        step = "" if film is None or at is None else f" {at}"  # of the history that is shown
        self.save.set_name(f"{kind}{self._name}{step}" if self._name else "")

    def _draw_line(self) -> None:
        self.finger.sight.draws_line = self.plot.draw.isChecked()
        if self.finger.sight.draws_line:
            self.plot.source.setCurrentIndex(LINE)

    def _cut(self) -> None:
        if self.finger.sight.line is not None:
            self.plot.source.setCurrentIndex(LINE)
        self._paint()

    def _probe(self, place: tuple[float, float] | None) -> None:
        canvases = [self.finger, *([self.other] if self.other.isVisible() else [])]
        readouts = [] if place is None else [canvas.words_at(place) for canvas in canvases]
        self.probe.show_text("  |  ".join(filter(None, readouts)))

    def _show_step(self, at: int) -> None:
        self._at = at
        self._paint()

    def _ask_history(self) -> None:
        row = None if self._state is None else selected_row(self._state)
        if row is not None:
            self._ask(m.ShowHistory(row.key))
            self.player.slider.setFocus()

    def _ask_where(self, row: Row | None, version: int) -> None:
        """Ask how far a solve without an answer came, once."""
        prediction = None if row is None else row.prediction
        if row is None or prediction is None or prediction.sed is not None or not was_tried(prediction):
            return
        if (row.key, version) != self._history_request:
            self._history_request = row.key, version
            self._ask(m.ShowHistory(row.key))

    def _save(self, name: str, path: str) -> None:
        self._ask(m.Write(f"picture {name}", path))

    def _head(self) -> str:
        """Return what every picture of a field is marked with: whether simulated, the session, and its errors."""
        report = None if self._state is None else self._state.report
        marks = () if report is None else (report.head, report.session)
        return "\n".join((" · ".join(filter(None, marks)), tr(FIELD_ERRORS)))

    def _save_finger(self, name: str, path: str) -> None:
        """Write the picture of the SED as the report draws it, and any other field as it is shown."""
        if self.fields.field.name == SED.name:
            self._save(name, path)
            return
        try:
            write_picture(self.finger, self._head(), Path(path))
        except OSError as error:
            why = error.strerror
            self._say(tr("{path} could not be written ({why}): choose another folder.", path=path, why=why))
        else:
            self._say(tr("Saved: {path}", path=path))

    def _ask_film(self) -> None:
        file_name = f"{self.fields.field.name.replace(' ', '-')}{self._name.replace(' ', '-')}.gif"
        path, _ = QFileDialog.getSaveFileName(self, tr("Save the film"), file_name, "GIF (*.gif);;MP4 (*.mp4)")
        if path:
            self.write_film(Path(path if path.lower().endswith(FILM_SUFFIXES) else f"{path}.gif"))

    def write_film(self, path: Path) -> None:
        """Write the history that is shown as a film, and say what came of it."""
        assert self._film is not None
        before, self._filming = self._at, True
        try:
            sentence = write_film(self.finger, self._head(), self._show_step, len(self._film.film.frames), path)
        finally:
            self._filming, self._at = False, before
            self._paint()
        self._say(sentence)

    def _finger_page(self) -> QWidget:
        page = QWidget()
        fingers, play = hbox((self.finger, 1), (self.other, 1)), hbox((self.player, 1), self.film)
        acts = hbox(self.near, self.mesh, self.together, self.history, (self.save, 1))
        plots = (fingers, 3), self.probe, (self.plot, 1)
        vbox(self.fields, *plots, self.errors, self.why, play, acts, on=page)
        return page
