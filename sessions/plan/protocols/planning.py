"""The plan of one session, made from its protocol: subject, stimuli, labels and order."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, count, pairwise

from sessions.plan.orders import draw, next_comparison, pairs, pairs_with, shuffle, williams
from sessions.plan.plan import (
    DISTAL_TO_PROXIMAL,
    PROXIMAL_TO_DISTAL,
    Block,
    Finger,
    Frame,
    Hand,
    Phase,
    SessionPlan,
    Stimulus,
    Trial,
)
from sessions.plan.protocols.protocol import LARGEST_SEED, BlockOutline, Labels, Protocol, check_depth, check_phases
from sessions.toml_file import SettingsError, check, check_range

DIRECTIONS = {"proximal to distal": PROXIMAL_TO_DISTAL, "distal to proximal": DISTAL_TO_PROXIMAL}


@dataclass(frozen=True, slots=True)
class Body:
    """Values of one subject; None where the protocol's or the model's value is used."""

    finger: Finger = field(default_factory=Finger)
    contact_angle: float | None = None  # between the finger's axis and the face [degrees]
    indentations: Mapping[str, float] = field(default_factory=dict[str, float])  # block -> [mm]


@dataclass(frozen=True, slots=True)
class StudyPlace:
    """A subject's place in a study: the row of its design, and the labels that hold throughout it."""

    study: str
    slot: int  # of the subject among all that were enrolled, from 0
    row: int  # from 1
    seed: int  # of the study: decides which stimulus is which letter of the design
    labels: Labels
    key_sha256: str | None = None  # of the sealed key; None: not blinded


@dataclass(frozen=True, slots=True)
class VisitSetting:
    """Settings of one visit; frame and area of the face, where given, replace the protocol's."""

    frame: Frame | None = None
    contact_area: float | None = None  # [mm2]
    stroking_hand: Hand | None = None  # None: nobody stated it
    answering_hand: Hand | None = None
    language: str | None = None  # that the subject reads; None: the protocol's own


def plan(
    protocol: Protocol,
    subject: str,
    seed: int,
    *,
    forces: bool = True,
    setting: VisitSetting | None = None,
    phases: Sequence[Phase] | None = None,
    body: Body | None = None,
    place: StudyPlace | None = None,
) -> SessionPlan:
    """Return the plan of one session.

    `forces` is False for a visit that only scores. `phases`, where given, replace the protocol's. Raises
    SettingsError where `subject` is no code or another value is out of range.
    """
    subject_body, visit_setting = body or Body(), setting or VisitSetting()
    planned_phases = protocol.phases if phases is None else phases
    protocol = protocol if visit_setting.language is None else protocol.in_language(visit_setting.language)
    check(is_code(subject), "subject", subject, CODE_RULE)
    check_range("seed", seed, 0, LARGEST_SEED)
    check_phases(protocol, planned_phases)
    check_body(subject_body, protocol)
    area = protocol.face.contact_area if visit_setting.contact_area is None else visit_setting.contact_area
    rows = design_rows(protocol)
    row = None if rows is None else (seed % rows if place is None else place.row - 1) % rows + 1
    design_seed = protocol.label_seed if place is None else place.seed
    outlines = block_order(protocol, seed if place is None else place.slot)
    labels = protocol.labels if place is None else place.labels
    blocks = _Blocks(protocol, outlines, seed, row, design_seed, subject_body, labels)
    plan = SessionPlan(
        protocol=protocol.name,
        subject=subject,
        seed=seed,
        order_rule=_order_rule(protocol, row, outlines[0]),
        blocks=tuple(blocks.for_phases(planned_phases)),
        forces=forces,
        frame=visit_setting.frame or protocol.face.frame,
        contact_angle=protocol.contact_angle if subject_body.contact_angle is None else subject_body.contact_angle,
        contact_angle_origin="set" if subject_body.contact_angle is None else "measured",
        stroking_hand=visit_setting.stroking_hand,
        answering_hand=visit_setting.answering_hand,
        finger=subject_body.finger,
        rests=protocol.rests,
        shown=protocol.shown,
        masking=protocol.masking,
        language=protocol.language,
        study=None if place is None else place.study,
        order_row=row,
        order_seed=None if row is None else design_seed,
        key_sha256=None if place is None else place.key_sha256,
    )
    if plan.key_sha256 is not None:
        plan = blind(plan)
    return plan if area is None else replace(plan, contact_area=area, contact_area_origin="set")


def _order_rule(protocol: Protocol, row: int | None, first_block: BlockOutline) -> str:
    """Return the origin of a session's order in words: rule, row of the design, first block."""
    rule = protocol.order.rule if row is None else f"{protocol.order.rule}, row {row} of {design_rows(protocol)}"
    counterbalanced = protocol.order.blocks == "counterbalanced"
    return f"{rule}; blocks counterbalanced, {first_block.name} first" if counterbalanced else rule


CODE_RULE = "a code of letters, digits, - and _ (at most 32), never a name"


def is_code(text: str) -> bool:
    """Say whether a text is a code as `CODE_RULE` demands, safe in a file name."""
    return re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}", text) is not None


def design_rows(protocol: Protocol) -> int | None:
    """Return the number of rows of the protocol's design; None where each order is drawn independently."""
    if protocol.order.rule != "williams":
        return None
    return max(len(williams(len(block.indices))) for block in protocol.blocks)


def block_order(protocol: Protocol, number: int) -> tuple[BlockOutline, ...]:
    """Return the blocks in a subject's order; counterbalanced, it begins `number` blocks (from 0) later."""
    start = number % len(protocol.blocks) if protocol.order.blocks == "counterbalanced" else 0
    return protocol.blocks[start:] + protocol.blocks[:start]


def blind(plan: SessionPlan) -> SessionPlan:
    """Return the plan with codes alone, without the indices of the stimuli."""
    return plan.with_trials(lambda trial: replace(trial, stimulus=replace(trial.stimulus, index=None)))


def check_body(body: Body, protocol: Protocol) -> None:
    """Raise NotAllowed where one of a subject's values is out of range."""
    check_range("contact_angle", body.contact_angle, 10, 90, "degrees")
    check_range("tip_radius", body.finger.tip_radius, 3, 15, "mm")
    check_range("width", body.finger.width, 5, 40, "mm")
    names = [block.name for block in protocol.blocks]
    for name, depth in body.indentations.items():
        check(name in names, "depth", name, f"there is no such block; {protocol.name} has {', '.join(names)}")
        check_depth(f"depth of {name}", depth)


@dataclass(eq=False)
class _Blocks:
    """Makes the blocks of a plan in turn, with trials numbered across them."""

    protocol: Protocol
    outlines: Sequence[BlockOutline]  # in the subject's order
    seed: int
    row: int | None
    design_seed: int
    body: Body
    labels: Labels

    def __post_init__(self) -> None:
        self._numbers = count(1)

    def for_phases(self, phases: Sequence[Phase]) -> Iterator[Block]:
        """Yield the pre-evaluation of every descriptor, then each block after its practice."""
        pre_evaluation = self.protocol.pre_evaluation
        for outline in self.outlines if "pre-evaluation" in phases else ():
            name = f"{outline.name}, pre-evaluation"
            instruction = outline.instruction if pre_evaluation is None else pre_evaluation.instruction
            yield self._block(outline, "pre-evaluation", name, [self._random_order(outline, name)], instruction)
        for outline in self.outlines:
            if "practice" in phases and outline.practice:
                choice = self.protocol.scale.answer == "choice"
                order = tuple(chain.from_iterable(pairwise(outline.practice))) if choice else outline.practice
                yield self._block(outline, "practice", f"{outline.name}, practice", [order], outline.instruction)
            if "main" in phases:
                yield self._block(outline, "main", outline.name, self._orders(outline), outline.instruction)

    def _orders(self, outline: BlockOutline) -> list[tuple[int, ...]]:
        orders: list[tuple[int, ...]] = []
        comparisons, standard = outline.adaptive, outline.standard
        if comparisons is not None and standard is not None:  # each answer then chooses the next comparison
            comparison = next_comparison(self._candidates(outline), ()).known_index
            leaders = shuffle(range(comparisons), self.seed, f"{outline.name}/first")[: comparisons // 2]
            return [(comparison, standard) if n in leaders else (standard, comparison) for n in range(comparisons)]
        for repetition in range(1, outline.repetitions + 1):
            name = outline.name if repetition == 1 else f"{outline.name}#{repetition}"
            if self.protocol.scale.answer == "choice":
                by_code = self._by_code(outline)
                drawn_pairs = self._pairs(outline, tuple(by_code), repetition, name)
                orders.append(tuple(by_code[code] for code in chain.from_iterable(drawn_pairs)))
            elif self.row is not None:
                orders.append(self._row_of_design(outline, self.row - 1 + repetition - 1))
            else:
                orders.append(self._random_order(outline, name, [order[0] for order in orders]))
        return orders

    def _candidates(self, outline: BlockOutline) -> tuple[Stimulus, ...]:
        """Return the stimuli compared with the standard of an adaptive block, by index; none in other blocks."""
        comparisons = sorted(set(outline.indices) - {outline.standard}) if outline.adaptive is not None else ()
        return tuple(self._stimulus(outline, index) for index in comparisons)

    def _stimulus(self, outline: BlockOutline, index: int) -> Stimulus:
        return Stimulus(outline.descriptor, index, self.labels[outline.descriptor, index])

    def _pairs(
        self, outline: BlockOutline, codes: Sequence[str], repetition: int, name: str
    ) -> tuple[tuple[str, str], ...]:
        """Return the pairs of one repetition: every two stimuli, or each with the standard, if any."""
        if outline.standard is None:
            return pairs(codes, self.seed, name)
        standard = self.labels[outline.descriptor, outline.standard]
        comparisons = [code for code in codes if code != standard]
        return pairs_with(standard, comparisons, self.seed, outline.name, repetition)

    def _random_order(self, outline: BlockOutline, name: str, begun_with: Sequence[int] = ()) -> tuple[int, ...]:
        """Return a random order that meets the protocol's constraints; it orders codes, so that it reveals no index."""
        by_code = self._by_code(outline)
        order = draw(
            tuple(by_code),
            self.seed,
            name,
            lambda codes: self.protocol.order.meets([by_code[code] for code in codes], begun_with),
        )
        if order is None:
            raise SettingsError(f"no order of {outline.name} was found that meets the constraints; use another seed")
        return tuple(by_code[code] for code in order)

    def _row_of_design(self, outline: BlockOutline, row: int) -> tuple[int, ...]:
        """Return a row of the Williams design, whose letters are assigned to codes at random, once for the study."""
        by_code = self._by_code(outline)
        letters = shuffle(tuple(by_code), self.design_seed, f"{outline.name}/letters")
        rows = williams(len(letters))
        return tuple(by_code[letters[letter]] for letter in rows[row % len(rows)])

    def _by_code(self, outline: BlockOutline) -> dict[str, int]:
        return {self.labels[outline.descriptor, index]: index for index in outline.indices}

    def _block(
        self, outline: BlockOutline, phase: Phase, name: str, orders: Sequence[Sequence[int]], instruction: str
    ) -> Block:
        depth = self.body.indentations.get(outline.name)
        direction = DIRECTIONS[outline.direction]
        answer = self.protocol.scale.answer
        times: Counter[int] = Counter()
        trials: list[Trial] = []
        for index in chain.from_iterable(orders):
            times[index] += 1
            second = answer == "choice" and len(trials) % 2 == 1
            trials.append(
                Trial(
                    number=next(self._numbers),
                    block=name,
                    stimulus=self._stimulus(outline, index),
                    direction=direction,
                    repetition=times[index],
                    phase=phase,
                    answer="none" if answer == "choice" and not second else answer,
                    compared_with=trials[-1].number if second else None,
                    standard=index == outline.standard,
                )
            )
        return Block(
            name=name,
            instruction=instruction,
            direction=direction,
            indentation=outline.indentation if depth is None else depth,
            scale_ends=outline.scale_ends or ("", ""),
            trials=tuple(trials),
            phase=phase,
            question=outline.question,
            strokes_allowed=outline.strokes_allowed,
            ticks=self.protocol.scale.ticks,
            indentation_origin="set" if depth is None else "measured",
            candidates=self._candidates(outline) if phase == "main" else (),
        )
