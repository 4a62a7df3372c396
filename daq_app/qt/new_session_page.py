"""The page of a new session: a checklist of cards, each with one line on what is missing."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QSignalBlocker, Signal
from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import QComboBox, QCompleter, QFileDialog, QRadioButton, QWidget

from daq_app.qt.cards import CardFrame, CutShort, ScreenFields, TransducerRow
from daq_app.qt.layout import hbox, scroll_area, set_horizontal, vbox
from daq_app.qt.parts import Panel, WrappedLabel, button, choice, entry, field, label, tick
from daq_app.qt.tokens import GRID, TARGET, px
from daq_app.window.checklist import CARD_FIELDS, Card, checklist, codes_in, first_missing, next_code, studies_in
from daq_app.window.new_session import Bench, SessionForm, enrol_subject, enrolment, optional_phases
from daq_app.window.state import LanguageChosen, Message
from daq_app.wording import tr, tr_noop
from sessions.plan.plan import NORMALS, Hand
from sessions.plan.protocols.protocol import ENGLISH, protocol_names

TWO = 565  # width from which the cards are in two columns, before the font's scale [px]
HANDS: tuple[Hand | None, ...] = (None, "right", "left")
HAND_NAMES = tr_noop(("not stated", "right", "left"))


class NewSessionPage(Panel):
    """The left of the experimenter's window between sessions."""

    changed = Signal()

    def __init__(self, send: Callable[[Message], None], act: Callable[[str], None]) -> None:
        super().__init__(tr("new session"))
        self._send = send
        self._cards: tuple[Card, ...] = ()
        self._source: object = None  # source data of the cards
        self.frames = {name: CardFrame(name) for name in CARD_FIELDS}
        self.subject = entry(tr("subject code, never a name"))
        meaning = tr("take the proposed code")
        self._proposal = button("", meaning, lambda: self.subject.setText(self._proposal.text()), "small")
        self.protocol = choice(tr("protocol"), (*protocol_names(), tr("choose a file …")))
        self._protocol = SessionForm().protocol  # the last selection other than "choose a file"
        self.protocol.setCurrentText(self._protocol)
        self.protocol.activated.connect(self._choose_protocol)
        self.study = entry(tr("study, a folder of its own; may be empty"))
        self.studies = choice(self.study.accessibleName())
        self.studies.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.studies.setLineEdit(self.study)
        self.folder = entry(tr("folder in which sessions are kept"))
        self.folder.setText("recordings")
        self.seed = entry(tr("seed of the stimulus order; empty for a new one"), tr("a new one"))
        meaning = tr("height of the face above the transducer's origin in millimetres; may be empty")
        self.height_above = entry(meaning, tr("as stated"))
        meaning = tr("axis of the transducer along which pressing is positive")
        self.normal = choice(meaning, (tr("as stated"), *NORMALS))
        meaning = tr("contact area of finger and surface in square millimetres; may be empty")
        self.area = entry(meaning, tr("as stated"))
        hands = [tr(meaning) for meaning in HAND_NAMES]
        self.stroking, self.answering = choice(tr("stroking hand"), hands), choice(tr("answering hand"), hands)
        self.pre_evaluation = tick(tr("Pre-evaluation first"), tr("every stimulus judged once before all else"))
        self.practice = tick(tr("Practice first"), tr("practice before the trials that count"))
        self.with_forces, self.scores_only = self._either(tr("Forces, with the transducer"), tr("Scores only"))
        self.people_score, self.simulated = self._either(tr("People"), tr("Rehearse, simulated"))
        self.transducer = TransducerRow(act)
        self._people_words = WrappedLabel("quiet", keeps_room=True)
        self.screen_fields = ScreenFields(act, self.form)
        meaning = tr("pilot this protocol with simulated hand and answers")
        self._pilot = button(tr("Pilot  F5"), meaning, lambda: act("pilot"))
        self._pilot.setToolTip(tr("Runs on its own, needs no subject, and is stored separately in the folder “pilots”"))
        meaning = tr("preview every page that the subject will see")
        self._preview = button(tr("Preview  F7"), meaning, lambda: act("preview"))
        self._enrol = button(tr("Enrol"), tr("enrol the subject in the study"), self._enrol_subject)
        self.cut_short = CutShort(send)
        self._height, self._area = QWidget(), QWidget()
        self._lines = {
            "subject": self.subject, "study": self.study, "folder": self.folder, "seed": self.seed,
            "height": self.height_above, "area": self.area,
        }  # fmt: skip
        self._build()
        self._follow()
        self._place_changed()
        self._show_study()

    def _either(self, *texts: str) -> list[QRadioButton]:
        """Return exclusive buttons, the first of them pressed."""
        buttons = [QRadioButton(option) for option in texts]
        for option in buttons:
            option.setAccessibleName(option.text())
            option.setMinimumHeight(TARGET - GRID)
        buttons[0].setChecked(True)
        return buttons

    def _follow(self) -> None:
        for line in self._lines.values():
            line.textChanged.connect(self.changed)
        for widget in (self.with_forces, self.scores_only, self.people_score, self.simulated):
            widget.toggled.connect(self.changed)
        for line in (self.subject, self.study, self.folder):
            line.textChanged.connect(self._show_study)
        self.protocol.currentTextChanged.connect(self._show_study)
        for follow in (self.screen_fields.show_form, self._speak, self.changed):
            self.screen_fields.language.currentIndexChanged.connect(follow)
        for line in (self.study, self.folder):
            line.textChanged.connect(self._place_changed)
        self.folder.editingFinished.connect(self.look_for_unfinished_sessions)

    def form(self) -> SessionForm:
        return SessionForm(
            subject=self.subject.text(),
            protocol=self.protocol.currentText(),
            study=self.study.text(),
            folder=self.folder.text(),
            seed=self.seed.text(),
            stroking_hand=HANDS[self.stroking.currentIndex()],
            answering_hand=HANDS[self.answering.currentIndex()],
            pre_evaluation=self.pre_evaluation.isVisibleTo(self) and self.pre_evaluation.isChecked(),
            practice=self.practice.isVisibleTo(self) and self.practice.isChecked(),
            language=self.screen_fields.language.currentData() or "",
            forces=self.with_forces.isChecked(),
            height=self.height_above.text() if self._height.isVisibleTo(self) else "",
            normal=self.normal.currentText() if self._height.isVisibleTo(self) else "",
            area=self.area.text() if self.with_forces.isChecked() else "",
            simulated=self.simulated.isChecked(),
            tablet=self.screen_fields.problem,
        )

    def show_bench(self, bench: Bench) -> None:
        # A simulated bench knows the height of its face.
        self._height.setVisible(self.with_forces.isChecked() and bench.frame is None)
        self._area.setVisible(self.with_forces.isChecked())
        text = tr("The subject strokes the transducer and scores.")
        if self.simulated.isChecked():
            text = tr(
                "Nobody is needed: strokes and scores are simulated, and marked as such. "
                "Your own sample has the friction that its protocol sets, or else that of the nearest of ten."
            )
        elif bench.simulated and self.with_forces.isChecked():
            text = tr("A simulated hand strokes when asked; you mount, and you or a subject score.")
        elif self.scores_only.isChecked():
            text = tr("The subject strokes and scores; no forces are recorded.")
        self._people_words.show_text(text)
        may = bench.simulated or self.scores_only.isChecked() or not bench.connected
        self.simulated.setEnabled(may)
        if not may and self.simulated.isChecked():
            self.people_score.setChecked(True)

    def check(self, bench: Bench, *, anew: bool = False) -> tuple[Card, ...]:
        """Show and return the cards; the disk is read only after a change."""
        source = self.form(), bench, self.screen_fields.status
        if anew or source != self._source:
            self._source = source
            self._cards = checklist(*source)
            for card in self._cards:
                self.frames[card.name].show_card(card)
        return self._cards

    def go_to_missing(self) -> None:
        """Mark what is missing, scroll to the card of the headline, and focus the first field."""
        fields: dict[str, QWidget] = {**self._lines, "protocol": self.protocol}
        gaps = [card for card in self._cards if not card.ready]
        for card in gaps:
            self.frames[card.name].insist()
        first = next((fields[card.field] for card in gaps if card.field in fields), None)
        if first is not None:
            first.setFocus()
        if (card := first_missing(self._cards)) is not None:
            self._scroll.ensureWidgetVisible(self.frames[card.name].message)

    def look_for_unfinished_sessions(self) -> None:
        self.cut_short.look_in(self.form().root_folder)

    def _show_study(self) -> None:
        """Show the subject's enrolment; the study fixes protocol and orders."""
        record, phases = enrolment(self.form()), optional_phases(self.form())
        self.pre_evaluation.setVisible("pre-evaluation" in phases)
        self.practice.setVisible("practice" in phases)
        self._enrol.setVisible(record is not None and record.may_enrol)
        self.screen_fields.offer_languages()
        self.screen_fields.show_form()
        for widget in (self.protocol, self.seed):
            widget.setEnabled(record is None)
            widget.setToolTip("" if record is None else tr("the study's own: {protocol}", protocol=record.protocol))

    def _speak(self) -> None:
        """Show the subject's page in the chosen language before there is a session."""
        self._send(LanguageChosen(self.screen_fields.language.currentData() or ENGLISH))

    def _enrol_subject(self) -> None:
        refusal = enrol_subject(self.form())
        self._show_study()
        self._source = None  # the study has changed, not the form
        self.changed.emit()
        if refusal:
            self.frames["Subject"].show_card(Card("Subject", ready=False, text=refusal, field="subject"))

    def _choose_protocol(self, index: int) -> None:
        if index == self.protocol.count() - 1:
            self.protocol.setCurrentText(self._protocol)  # until a file is chosen, and if none is
            self.add_protocol(QFileDialog.getOpenFileName(self, tr("Protocol"), "", "Protocol (*.toml)")[0])
        self._protocol = self.protocol.currentText()
        self.changed.emit()

    def add_protocol(self, path: str) -> None:
        """Select the protocol in a file; an empty path keeps the selection."""
        if path:
            self.protocol.insertItem(self.protocol.count() - 1, path)
            self.protocol.setCurrentIndex(self.protocol.count() - 2)
            self._protocol = path
            self.changed.emit()

    def _choose_folder(self) -> None:
        name = QFileDialog.getExistingDirectory(self, tr("Folder of sessions"), str(self.form().root_folder.absolute()))
        if name:
            self.folder.setText(name)
            self.look_for_unfinished_sessions()

    def _place_changed(self) -> None:
        """Offer the studies of the folder, and the next free code."""
        names = ["", *studies_in(self.form().root_folder)]
        if names != [self.studies.itemText(index) for index in range(self.studies.count())]:
            with QSignalBlocker(self.study):  # keeps the text of the field
                typed = self.study.text()
                self.studies.clear()
                self.studies.addItems(names)
                self.studies.setEditText(typed)
            if (completer := self.studies.completer()) is not None:  # an editable list has one
                completer.setCompletionMode(QCompleter.CompletionMode.PopupCompletion)
        code = next_code(codes_in(self.form().parent_folder))
        self.subject.setPlaceholderText(tr("e.g. {code}", code=code))
        self._proposal.setText(code)

    def _build(self) -> None:
        height = field(tr("Height of the face above the transducer's origin [mm]"), self.height_above)
        vbox(height, field(tr("Axis along which pressing is positive"), self.normal), on=self._height)
        vbox(field(tr("Contact area, for τ max [mm²]"), self.area), on=self._area)
        folder_button = button("…", tr("choose the folder of sessions"), self._choose_folder)
        columns = (
            {
                "Subject": (
                    field(tr("Subject code"), self.subject, self._proposal),
                    self._enrol,
                    field(tr("Stroking hand"), self.stroking),
                    field(tr("Answering hand"), self.answering),
                ),
                "Transducer": (self.transducer, self.with_forces, self.scores_only, self._height, self._area),
                "Subject's screen": (self.screen_fields,),
            },
            {
                "Study and protocol": (
                    field(tr("Study, may be empty"), self.studies),
                    field(tr("Protocol"), self.protocol),
                    self.pre_evaluation,
                    self.practice,
                    field(tr("Seed of the order"), self.seed),
                    label(tr("Who strokes and scores"), "quiet", wrap=True),
                    hbox(self.people_score, self.simulated, 1),
                    self._people_words,
                    self._preview,
                    self._pilot,
                ),
                "Disk": (field(tr("Folder"), self.folder, folder_button),),
            },
        )
        for name, widgets in (columns[0] | columns[1]).items():
            self.frames[name].add(*widgets)
        left, right = (vbox(*(self.frames[name] for name in names), 1, spacing=GRID) for names in columns)
        self._columns = vbox((left, 1), (right, 1))
        inside = QWidget()
        vbox(label(tr("New session"), "title"), self.cut_short, self._columns, 1, on=inside, margins=GRID, spacing=GRID)
        self._scroll = scroll_area(inside)
        vbox(self._scroll, on=self, margins=2)
        self.setMinimumWidth(px(280, most=1.25))

    def resizeEvent(self, event: QResizeEvent) -> None:
        set_horizontal(self._columns, self.width() >= px(TWO))

    def showEvent(self, event: QShowEvent) -> None:
        """Propose the next code after a session has ended."""
        self._place_changed()

    def changeEvent(self, event: QEvent) -> None:
        """Search for studies again when the window is activated: another program may have made one."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.ActivationChange:
            self._place_changed()
