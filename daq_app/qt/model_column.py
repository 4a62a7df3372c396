"""The model's answer to the chosen trial: finger and history; pictures of the session; another session."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QTabWidget, QWidget

from daq_app.analyst import state as m
from daq_app.analyst.finger_words import compare_reports, film_text, finger_text, name_and_errors, other_finger
from daq_app.analyst.frame import FIELD_ERRORS, automatic_range
from daq_app.analyst.session_words import picture_errors, scene_table, session_pictures
from daq_app.analyst.state import AnalystState, Row, selected_row
from daq_app.qt.finger_canvas import FingerCanvas
from daq_app.qt.finger_painter import Look
from daq_app.qt.layout import hbox, vbox
from daq_app.qt.parts import WrappedLabel, button, choice
from daq_app.qt.pictures import FILM_SUFFIXES, ComparedView, PictureView, SaveButtons, write_film, write_picture
from daq_app.qt.plots import LINE, OWN, FieldBar, FieldPlot
from daq_app.qt.tables import TextTable
from daq_app.qt.tokens import GRID, Tokens
from daq_app.qt.transport_bar import TransportBar
from daq_app.wording import tr
from solver.quantities import SED

FINGER, SESSION, _COMPARISON = range(3)  # tabs
COMPARISON_NAME = "compared"  # name of the picture of two sessions in requests
_MARGINS = GRID // 2, GRID, GRID // 2, GRID  # of a tab [px]: with wider sides three columns need over 1440
STEPS_A_SECOND = 10.0  # when a history plays: steps, because pressing takes long and sliding little time


class ModelColumn(QWidget):
    """Four tabs: the finger, pictures of the session, another session, and the scene."""

    def __init__(self, tokens: Tokens, ask: Callable[[m.Ask], None], show: Callable[[str], None]) -> None:
        """Show nothing; `ask` sends requests, `show` takes messages about saved files."""
        super().__init__()
        self._ask, self._show_message = ask, show
        self._state = AnalystState(Path())
        self._film: m.FingerHistory | None = None
        self._name = ""  # of the finger's pictures, after their kind
        self._picture_request = ("", -1)  # requested picture, and version of the report
        self._history_request: tuple[m.Key, int] | None = None  # of a trial without an answer, and version
        self._index: int | None = None  # of the film; None: the state in full slip
        self.finger = FingerCanvas(tokens)
        self.compared_finger = FingerCanvas(tokens, self.finger.sight)  # of the compared session
        self.compared_finger.hide()
        self.fields, self.plot = FieldBar(), FieldPlot(tokens)
        self.probe, self.errors = WrappedLabel("quiet", keeps_room=True), WrappedLabel("quiet")
        self.fields.changed.connect(self._paint)
        self.plot.changed.connect(self._paint)
        self.plot.draw.toggled.connect(self._draw_line)
        self.finger.sight.pointed.connect(self._probe)
        self.finger.sight.cut.connect(self._cut)
        for canvas in (self.finger, self.compared_finger):
            canvas.range_chosen.connect(self.fields.fix)
        texts = {
            tr("Contact"): tr("show the contact alone, with its tractions"),
            tr("Mesh"): tr("show the mesh"),
            tr("Both"): tr("show the finger of the compared session next to this one"),
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
        self.failure_label = WrappedLabel("value", "look")
        self.errors.show_text(tr(FIELD_ERRORS))
        self.picture_choice = choice(tr("picture of the session"))
        self.picture = PictureView(tr("the picture"), self._save)
        self.picture_choice.activated.connect(self._show_picture)
        self.session_errors = WrappedLabel("quiet")
        self.comparison = ComparedView(self._compare, self._save)
        self.scene = TextTable(tr("scene and model"), (tr("of the model"), tr("value"), tr("remark")))
        session = QWidget()
        vbox(self.picture_choice, self.session_errors, (self.picture, 1), on=session, margins=_MARGINS)
        self.tabs = QTabWidget()
        self.tabs.setAccessibleName(tr("pictures"))
        self.tabs.addTab(self._finger_page(), tr("Finger"))
        self.tabs.addTab(session, tr("Session"))
        self.tabs.addTab(self.comparison, tr("Comparison"))
        self.tabs.addTab(self.scene, tr("Scene"))
        self.tabs.currentChanged.connect(self._show_picture)
        vbox(self.tabs, on=self)

    def show_state(self, state: AnalystState) -> None:
        previous, self._state = self._state, state
        film = state.visible_film
        if film is not self._film:
            self._film = film
            self._index = None if film is None else len(film.film.instants) - 1
            count = 0 if film is None else len(film.film.instants)
            self.player.set_times([number / STEPS_A_SECOND for number in range(count)])
        row = selected_row(state)
        prediction, stroke = (None, None) if row is None else (row.prediction, row.stroke)
        self.history.setEnabled(film is None and prediction is not None and prediction.mu is not None)
        self.failure_label.show_text(film_text(film))
        if film is None:
            self._ask_where(row, state.version)
        drawable = film is not None or (row is not None and row.key in state.fingers)
        self._name = f" {stroke.number}" if drawable and stroke is not None else ""
        self.together.setVisible(state.comparison is not None)
        self._paint()
        self.scene.show_lines(scene_table(state))
        if previous.version != state.version:
            names = [title for _, title in session_pictures(state.report)]
            if names != [self.picture_choice.itemText(i) for i in range(self.picture_choice.count())]:
                self.picture_choice.clear()
                self.picture_choice.addItems(names)
        if (comparison := state.comparison) is not None and state.report is not None:
            names = (name_and_errors(state.report), name_and_errors(comparison.report))
            self.comparison.show_rows(compare_reports(state.report, comparison.report), names)
            if previous.comparison is not comparison:
                self._picture_request = ("", -1)
                self.together.setChecked(True)
                self._paint()
                self.tabs.setCurrentIndex(_COMPARISON)
        self._show_picture()

    def _show_picture(self, *_: object) -> None:
        """Show the picture of the tab; a picture not drawn yet is requested only when it is visible."""
        state, tab, index = self._state, self.tabs.currentIndex(), self.picture_choice.currentIndex()
        if tab == _COMPARISON and state.comparison is not None:
            view, name, caption = self.comparison.picture, COMPARISON_NAME, tr("both sessions")
        elif tab == SESSION and 0 <= index < len(names := session_pictures(state.report)):
            view, (name, caption) = self.picture, names[index]
            self.session_errors.show_text(picture_errors(state.report, name))
        else:
            return
        picture = state.pictures.get(name)
        if picture is not None:
            title = picture.title or tr("There are no numbers yet for: {words}", words=caption)
            view.show_picture(name, title, picture.png)
            return
        view.show_picture("", tr("Drawing: {words}", words=caption), b"")
        if self._picture_request != (name, state.version):
            self._picture_request = (name, state.version)
            self._ask(m.Draw(name))

    def _paint(self) -> None:
        state, film, index = self._state, self._film, self._index
        if film is not None and index is not None:
            finger, text = film.film.frames[index], film_text(film, index)
        else:
            row, text = selected_row(state), finger_text(state)
            finger = None if row is None else state.fingers.get(row.key)
        second, second_text = other_finger(state) if self.together.isChecked() else (None, "")
        lost = film.film.lost if film is not None and index == len(film.film.frames) - 1 else None
        field = self.fields.field
        present = tuple(frame for frame in (finger, second) if frame is not None)
        frames = tuple(film.film.frames) if film is not None and self._filming else present
        own_range = automatic_range(field, frames)  # one range for a whole film
        common = state.common_range(field)
        colour_range = own_range if self.fields.mode == OWN or (lost and own_range[1] > common[1]) else common
        look = Look(field, self.fields.range(colour_range), self.near.isChecked(), self.mesh.isChecked(), lost)
        pair = ((self.finger, finger, f"A  {text}"), (self.compared_finger, second, f"B  {second_text}"))
        panels = pair if second_text else ((self.finger, finger, text),)
        self.finger.sight.captions = tuple(caption for _, _, caption in panels)
        for canvas, frame, caption in panels:
            canvas.show_frame(frame, caption, look if canvas is self.finger else replace(look, lost=None), present)
        self.compared_finger.setVisible(bool(second_text))
        self.plot.show_field((finger, second) if second_text else (finger,), field, self.finger.sight.line)
        view_name = "contact" if self.near.isChecked() else "finger"
        self.film.setEnabled(bool(self._name) and film is not None)
        step = "" if film is None or index is None else f" {index}"  # of the displayed history
        self.save.set_name(f"{view_name}{self._name}{step}" if self._name else "")

    def _draw_line(self) -> None:
        self.finger.sight.draws_line = self.plot.draw.isChecked()
        if self.finger.sight.draws_line:
            self.plot.source.setCurrentIndex(LINE)

    def _cut(self) -> None:
        if self.finger.sight.line is not None:
            self.plot.source.setCurrentIndex(LINE)
        self._paint()

    def _probe(self, position: tuple[float, float] | None) -> None:
        canvases = [self.finger, *([self.compared_finger] if self.compared_finger.isVisible() else [])]
        readouts = [] if position is None else [canvas.readout_at(position) for canvas in canvases]
        self.probe.show_text("  |  ".join(filter(None, readouts)))

    def _show_step(self, index: int) -> None:
        self._index = index
        self._paint()

    def _ask_history(self) -> None:
        if (row := selected_row(self._state)) is not None:
            self._ask(m.ShowHistory(row.key))
            self.player.slider.setFocus()

    def _ask_where(self, row: Row | None, version: int) -> None:
        """Request the path of a solve without an answer, once, if the solver had all its inputs."""
        prediction = None if row is None else row.prediction
        if row is None or prediction is None or prediction.sed is not None:
            return
        friction_and_depth = prediction.mu, prediction.tau_max, prediction.indentation, prediction.direction
        if None not in friction_and_depth and (row.key, version) != self._history_request:
            self._history_request = row.key, version
            self._ask(m.ShowHistory(row.key))

    def _compare(self) -> None:
        folder = str(self._state.folder.parent)
        if name := QFileDialog.getExistingDirectory(self, tr("Session to compare with"), folder):
            self._ask(m.Compare(name))

    def _save(self, name: str, path: str) -> None:
        self._ask(m.Write(f"picture {name}", path))

    def _heading(self) -> str:
        """Return the heading of every picture of a field: whether simulated, the session, and its errors."""
        report = self._state.report
        marks = () if report is None else (report.head, report.session)
        return "\n".join((" · ".join(filter(None, marks)), tr(FIELD_ERRORS)))

    def _save_finger(self, name: str, path: str) -> None:
        """Save the picture of the SED as the report draws it, and any other field as shown."""
        if self.fields.field.name == SED.name:
            self._save(name, path)
            return
        try:
            write_picture(self.finger, self._heading(), Path(path))
        except OSError as error:
            reason = error.strerror
            self._show_message(tr("{path} could not be written ({why}): choose another folder.", path=path, why=reason))
        else:
            self._show_message(tr("Saved: {path}", path=path))

    def _ask_film(self) -> None:
        file_name = f"{self.fields.field.name.replace(' ', '-')}{self._name.replace(' ', '-')}.gif"
        path, _ = QFileDialog.getSaveFileName(self, tr("Save the film"), file_name, "GIF (*.gif);;MP4 (*.mp4)")
        if path:
            self.write_film(Path(path if path.lower().endswith(FILM_SUFFIXES) else f"{path}.gif"))

    def write_film(self, path: Path) -> None:
        assert self._film is not None
        previous, self._filming = self._index, True
        try:
            sentence = write_film(self.finger, self._heading(), self._show_step, len(self._film.film.frames), path)
        finally:
            self._filming, self._index = False, previous
            self._paint()
        self._show_message(sentence)

    def _finger_page(self) -> QWidget:
        page = QWidget()
        fingers, play = hbox((self.finger, 1), (self.compared_finger, 1)), hbox((self.player, 1), self.film)
        acts = hbox(self.near, self.mesh, self.together, self.history, (self.save, 1))
        plots = (fingers, 3), self.probe, (self.plot, 1)
        vbox(self.fields, *plots, self.errors, self.failure_label, play, acts, on=page, margins=_MARGINS)
        return page
