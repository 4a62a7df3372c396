"""Protocol: a readable file that says how sessions are run. It is checked before a session begins."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise, product
from pathlib import Path
from typing import Literal

import msgspec
from msgspec import structs

from sessions.plan.orders import draw, opaque_codes
from sessions.plan.plan import Frame, Phase, Rests, Visibility
from sessions.toml_file import (
    NotAllowed,
    SettingsError,
    check,
    check_range,
    check_scale_ends,
    check_text,
    from_toml,
    text_of,
)

FOLDER = Path(__file__).parent
LARGEST_SEED = 2**31 - 1  # a whole number that every language can hold
LEAST_COMPARISONS = 3  # with a standard: two do not determine PSE and just noticeable difference
Labels = dict[tuple[str, int], str]  # descriptor and index of a stimulus -> the code on its back
PRE_EVALUATION = "pre-evaluation"  # the name under which the instruction of that phase is translated
ENGLISH = "en"
# In the smallest type a screen of 960 by 540 points holds 1,500 letters of any script, but not 2,000 of Japanese.
LONGEST_TEXT = 1500  # that the subject reads
DEEPEST_INDENTATION = 10  # press of the model's finger [mm]
INDENTATIONS = f"above 0, up to {DEEPEST_INDENTATION} mm"


def check_depth(key: str, depth: float) -> None:
    """Raise NotAllowed for a depth [mm] that the model does not accept."""
    check(0 < depth <= DEEPEST_INDENTATION, key, depth, f"it must lie {INDENTATIONS}")


class BlockOutline(msgspec.Struct, frozen=True):
    """The stimuli of one descriptor and how they are stroked and judged; their order is not decided yet."""

    name: str
    descriptor: str
    direction: Literal["proximal to distal", "distal to proximal"]
    indentation: float  # depth the model presses the finger to [mm]
    indices: tuple[int, ...]  # of the stimuli, 0 to 100
    instruction: str  # read to the subject before the block
    scale_ends: tuple[str, str] | None = None  # what 0 and 100 mean, where the answer is on a line
    question: str = ""  # asked when an answer is due
    strokes_allowed: int = 1  # in a trial, before the answer
    repetitions: int = 1  # of each stimulus, or of each pair
    practice: tuple[int, ...] = ()  # stimuli of the practice trials, in their order
    simulated_friction: tuple[float, ...] = msgspec.field(default=(), name="planted_friction")  # µ of `indices` [-]
    standard: int | None = None  # one of `indices`, in every pair; None: every two stimuli are compared
    adaptive: int | None = None  # comparisons with the standard, each chosen from earlier answers; None: planned

    def __post_init__(self) -> None:
        """Check ranges."""
        for name in ("name", "descriptor", "instruction"):
            check_text(name, getattr(self, name))
        check_depth("indentation", self.indentation)
        indices, distinct = list(self.indices), 0 < len(self.indices) == len(set(self.indices))
        check(distinct, "indices", indices, "there must be at least one, and none may come twice")
        check(all(0 <= index <= 100 for index in indices), "indices", indices, "each must lie between 0 and 100")
        check_scale_ends(self.scale_ends)
        check_range("strokes_allowed", self.strokes_allowed, 1, 20)
        check_range("repetitions", self.repetitions, 1, 20)
        practice, friction = list(self.practice), list(self.simulated_friction)
        check(set(practice) <= set(indices), "practice", practice, f"each must be one of indices {indices}")
        allowed = f"one number for each of the {len(indices)} indices, or none at all"
        check(len(friction) in (0, len(indices)), "planted_friction", friction, allowed)
        in_range = all(0.01 <= mu <= 5.0 for mu in friction)
        check(in_range, "planted_friction", friction, "each must lie between 0.01 and 5")
        self._check_standard()

    def _check_standard(self) -> None:
        adaptive = self.adaptive is not None
        if adaptive:
            allowed = "it takes a standard, with which all are compared"
            check(self.standard is not None, "adaptive", self.adaptive, allowed)
            check_range("adaptive", self.adaptive, 10, 200, "comparisons")
            allowed = "an adaptive block repeats what its answers ask for"
            check(self.repetitions == 1, "repetitions", self.repetitions, allowed)
        if self.standard is None:
            return
        indices = list(self.indices)
        check(self.standard in indices, "standard", self.standard, f"it must be one of indices {indices}")
        allowed = f"with a standard there must be {LEAST_COMPARISONS} others: fewer fix no psychometric function"
        check(len(indices) > LEAST_COMPARISONS, "indices", indices, allowed)
        allowed = "with a standard it must be even, so that each comparison comes first as often as second"
        check(adaptive or self.repetitions % 2 == 0, "repetitions", self.repetitions, allowed)


@dataclass(frozen=True, slots=True)
class Translation:
    """The texts of one block in one language, the same texts as in the block."""

    language: str  # two or three small letters, as ISO 639 has them
    block: str  # its name, or "pre-evaluation" for the instruction of that phase
    instruction: str
    scale_ends: tuple[str, str] | None = None
    question: str = ""  # needed for every block: the program's own question is English

    def __post_init__(self) -> None:
        """Check the language, and that nothing is empty."""
        check_language("language", self.language)
        check_text("instruction", self.instruction)
        check_scale_ends(self.scale_ends)


def check_language(key: str, language: str) -> None:
    """Raise NotAllowed unless a text is the code of a language."""
    if not re.fullmatch(r"[a-z]{2,3}", language):
        raise NotAllowed(key, language, 'it must be the code of a language, two or three small letters such as "de"')


HEIGHTS = (-500, 500)  # of a face above the transducer's origin [mm]
AREAS = (1, 2000)  # of a contact [mm2]


@dataclass(frozen=True, slots=True)
class Face:
    """Position of the stimulus's face, and the contact area; None where nobody stated it."""

    normal: Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None = None
    height: float | None = None  # above the transducer's origin [mm]
    height_origin: Literal["measured", "set"] = "set"
    contact_area: float | None = None  # [mm2]

    def __post_init__(self) -> None:
        """Check ranges."""
        check_range("height", self.height, *HEIGHTS, "mm")
        check_range("contact_area", self.contact_area, *AREAS, "mm2")

    @property
    def frame(self) -> Frame:
        """Return the frame, each value with its origin."""
        return Frame().with_values(self.normal, self.height, self.height_origin)


@dataclass(frozen=True, slots=True)
class OrderRules:
    """How stimulus orders are made."""

    rule: Literal["shuffled", "williams"] = "shuffled"
    blocks: Literal["as listed", "counterbalanced"] = "as listed"  # counterbalanced: each subject starts a block later
    neighbours_apart: bool = False  # no two neighbours of the scale in a row
    not_first: tuple[int, ...] = ()  # indices that begin no block
    first_differs: bool = False  # repetitions of a block begin with different stimuli

    @property
    def constrained(self) -> bool:
        """Say whether any rule excludes an order."""
        return self.neighbours_apart or bool(self.not_first) or self.first_differs

    def meets(self, order: Sequence[int], begun_with: Sequence[int] = ()) -> bool:
        """Say whether an order of indices meets the rules, after repetitions that began with `begun_with`."""
        rank = {index: position for position, index in enumerate(sorted(order))}
        return (
            not (self.neighbours_apart and any(abs(rank[a] - rank[b]) == 1 for a, b in pairwise(order)))
            and order[0] not in self.not_first
            and not (self.first_differs and order[0] in begun_with)
        )


@dataclass(frozen=True, slots=True)
class Scale:
    """How the subject answers."""

    answer: Literal["line", "number", "choice"] = "line"
    ticks: int = 0  # marks on the line between its ends; answers gather at marks, so the default is none

    def __post_init__(self) -> None:
        """Check ranges."""
        check_range("ticks", self.ticks, 0, 99)
        check(not self.ticks or self.answer == "line", "ticks", self.ticks, "only a line has marks")


@dataclass(frozen=True, slots=True)
class PreEvaluation:
    """Every stimulus judged once beforehand, to see whether the maker's grading holds."""

    instruction: str

    def __post_init__(self) -> None:
        """Check that the instruction is not blank."""
        check_text("instruction", self.instruction)


@dataclass(frozen=True, slots=True)
class Protocol:
    """How sessions are run."""

    name: str
    title: str
    label_seed: int  # decides the opaque labels: the same stimulus bears the same label throughout a study
    contact_angle: float  # between the finger's axis and the surface [degrees]
    blocks: tuple[BlockOutline, ...]
    phases: tuple[Phase, ...] = ("main",)  # of a visit that names none
    masking: str = ""  # of sounds, such as "pink noise in headphones"; empty: none
    order: OrderRules = field(default_factory=OrderRules)
    scale: Scale = field(default_factory=Scale)
    rests: Rests = field(default_factory=Rests)
    shown: Visibility = field(default_factory=Visibility)
    pre_evaluation: PreEvaluation | None = None
    face: Face = field(default_factory=Face)
    language: str = ENGLISH  # of the texts above
    translations: tuple[Translation, ...] = ()  # of these texts, one table for each block and language

    def __post_init__(self) -> None:
        """Check ranges, that blocks and stimuli are distinct, and that answers and orders are possible."""
        is_code = re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", self.name) is not None
        check(is_code, "name", self.name, "it must be of small letters, digits and single hyphens")
        check_range("label_seed", self.label_seed, 0, LARGEST_SEED)
        check_range("contact_angle", self.contact_angle, 10, 90, "degrees")
        check(bool(self.blocks), "blocks", [], "there must be at least one")
        check_phases(self, self.phases)
        if self.order.blocks == "counterbalanced" and len(self.blocks) < 2:
            raise NotAllowed("order.blocks", self.order.blocks, "counterbalancing takes at least two blocks")
        check_language("language", self.language)
        names = [block.name for block in self.blocks]
        for i, (name, block) in enumerate(zip(names, self.blocks, strict=True)):
            check(name not in names[:i], f"blocks[{i}].name", name, "no two blocks may have the same name")
            self._check_answers(f"blocks[{i}]", block)
            self._check_order(f"blocks[{i}]", block)
        self._check_translations()

    @property
    def labels(self) -> Labels:
        """Return the code on the back of each stimulus; a stimulus of several blocks has one."""
        stimuli = dict.fromkeys((block.descriptor, index) for block in self.blocks for index in block.indices)
        return dict(zip(stimuli, opaque_codes(len(stimuli), self.label_seed), strict=True))

    @property
    def simulated_friction(self) -> tuple[tuple[str, int, float], ...]:
        """Return descriptor, index and μ of every stimulus whose friction the simulated bench uses."""
        return tuple(
            (block.descriptor, index, mu)
            for block in self.blocks
            for index, mu in zip(block.indices, block.simulated_friction, strict=False)  # none, or one for each index
        )

    @property
    def languages(self) -> tuple[str, ...]:
        """Return the languages that subjects may read, the protocol's own first."""
        return tuple(dict.fromkeys((self.language, *(texts.language for texts in self.translations))))

    def texts(self) -> Iterator[tuple[str, str]]:
        """Yield the key of each text that the subject reads, and the text."""
        for table, parts in (("blocks", self.blocks), ("translations", self.translations)):
            for number, part in enumerate(parts):
                yield f"{table}[{number}].instruction", part.instruction
                yield f"{table}[{number}].question", part.question
                for end in part.scale_ends or ():
                    yield f"{table}[{number}].scale_ends", end
        if self.pre_evaluation is not None:
            yield "pre_evaluation.instruction", self.pre_evaluation.instruction

    def in_language(self, language: str) -> "Protocol":
        """Return the protocol with its texts in a language. Raises NotAllowed where it has none."""
        if language == self.language:
            return self
        texts = {text.block: text for text in self.translations if text.language == language}
        if not texts:
            raise NotAllowed("language", language, f"{self.name} has its texts in {', '.join(self.languages)}")
        blocks = tuple(
            structs.replace(block, instruction=text.instruction, scale_ends=text.scale_ends, question=text.question)
            for block in self.blocks
            for text in [texts[block.name]]
        )
        translation = texts.get(PRE_EVALUATION)
        pre_evaluation = self.pre_evaluation if translation is None else PreEvaluation(translation.instruction)
        return replace(self, blocks=blocks, pre_evaluation=pre_evaluation, language=language, translations=())

    def _check_answers(self, key: str, block: BlockOutline) -> None:
        """Check that a block has every key that its kind of answer needs, and no others."""
        answer, ends, question = self.scale.answer, block.scale_ends, block.question
        if answer == "line":
            check(ends is not None, f"{key}.scale_ends", None, "both ends of the line must be named")
        else:
            allowed = f"a {answer} is given on no line: leave it out"
            check(ends is None, f"{key}.scale_ends", ends and list(ends), allowed)
            check(bool(question.strip()), f"{key}.question", question, f"say what the subject is asked for a {answer}")
        if answer == "choice":
            check(len(block.indices) > 1, f"{key}.indices", list(block.indices), "a choice takes at least two")
            check(len(block.practice) != 1, f"{key}.practice", list(block.practice), "a choice takes at least two")
        elif block.standard is not None:
            raise NotAllowed(f"{key}.standard", block.standard, "only a choice of two compares with a standard")

    def _check_translations(self) -> None:
        """Check that each language has every text of the protocol once, and no others."""
        scale_ends = {block.name: block.scale_ends for block in self.blocks}
        names = [*scale_ends, *([PRE_EVALUATION] if self.pre_evaluation is not None else [])]
        translated: set[tuple[str, str]] = set()
        for number, translation in enumerate(self.translations):
            key, language, block = f"translations[{number}]", translation.language, translation.block
            allowed = "it is the protocol's own: its texts are in the blocks"
            check(language != self.language, f"{key}.language", language, allowed)
            check(block in names, f"{key}.block", block, f"it must be one of {', '.join(names)}")
            is_new = (language, block) not in translated
            check(is_new, f"{key}.block", block, f'"{language}" has its texts already')
            translated.add((language, block))
            ends = translation.scale_ends
            remedy = "name both ends of its line" if ends is None else "it has no line: leave its ends out"
            check((ends is None) == (scale_ends.get(block) is None), f"{key}.scale_ends", ends and list(ends), remedy)
            has_question = block not in scale_ends or bool(translation.question.strip())
            allowed = f"say what is asked of {block} in this language"
            check(has_question, f"{key}.question", translation.question, allowed)
        for language, block in product(self.languages[1:], names):
            has_texts = (language, block) in translated
            check(has_texts, "translations", language, f'the texts of {block} are missing in "{language}"')

    def _check_order(self, key: str, block: BlockOutline) -> None:
        rule, by_pairs = self.order.rule, self.scale.answer == "choice"
        if self.order.constrained and (rule == "williams" or by_pairs):
            reason = "a Williams design fixes its orders" if rule == "williams" else "pairs are in no such order"
            raise NotAllowed("order.rule", rule, f"{reason}: leave the other keys of [order] out")
        if rule == "williams" and by_pairs:
            raise NotAllowed("order.rule", rule, 'pairs are "shuffled"')
        if self.order.first_differs and block.repetitions > len(set(block.indices) - set(self.order.not_first)):
            reason = "more repetitions than stimuli that may be first, and first_differs asks for another each time"
            raise NotAllowed(f"{key}.repetitions", block.repetitions, reason)
        if self.order.constrained and draw(block.indices, 0, block.name, self.order.meets) is None:
            raise NotAllowed(f"{key}.indices", list(block.indices), "no order of these meets what [order] asks for")


def check_phases(protocol: Protocol, phases: Sequence[Phase]) -> None:
    """Raise NotAllowed unless the protocol has these phases."""
    phase_names = list(phases)
    distinct = 0 < len(phases) == len(set(phases))
    check(distinct, "phases", phase_names, "there must be at least one, and none may come twice")
    if "pre-evaluation" in phases and protocol.pre_evaluation is None:
        raise NotAllowed("phases", phase_names, "a pre-evaluation needs a table [pre_evaluation] with its instruction")
    if "pre-evaluation" in phases and protocol.scale.answer == "choice":
        raise NotAllowed("phases", phase_names, "a pre-evaluation grades each stimulus, which a choice of two does not")
    if "practice" in phases and not any(block.practice for block in protocol.blocks):
        raise NotAllowed("phases", phase_names, "a practice needs blocks that list their stimuli under practice")


def phases_before(protocol: Protocol) -> tuple[Phase, ...]:
    """Return the phases that may come before the trials of the experiment."""
    is_judged = protocol.pre_evaluation is not None and protocol.scale.answer != "choice"
    practised = any(block.practice for block in protocol.blocks)
    has: dict[Phase, bool] = {"pre-evaluation": is_judged, "practice": practised}
    return tuple(phase for phase, present in has.items() if present)


def protocol_names() -> tuple[str, ...]:
    """Return the names of the protocols that come with the program: the files of this folder."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def protocol(name_or_path: str | Path) -> Protocol:
    """Return the built-in protocol of that name, or the one in the file of that path.

    Raises SettingsError for an unknown name and for anything wrong in the file, FileNotFoundError for a missing file.
    """
    path = protocol_file(name_or_path)
    return new_protocol(text_of(path), str(path))


@lru_cache  # the window calls this at each key press
def new_protocol(text: str, where: str) -> Protocol:
    """Return the protocol that a TOML text describes, if a subject's screen holds its texts. Raises SettingsError.

    The protocol of an existing study is read without this check.
    """
    description = from_toml(text, Protocol, where)
    for key, words in description.texts():
        if len(words) > LONGEST_TEXT:
            has = f"has {len(words):,} letters, and a subject's screen holds {LONGEST_TEXT:,}"
            raise SettingsError(f"{where}: {key} {has}; shorten it")
    return description


def protocol_file(name_or_path: str | Path) -> Path:
    """Return the file of a built-in protocol, or the path given. Raises SettingsError for an unknown name."""
    text = str(name_or_path)
    if text in protocol_names():
        return FOLDER / f"{text}.toml"
    if not text.endswith(".toml"):
        built_in = ", ".join(protocol_names())
        raise SettingsError(f"there is no protocol {text}; built in: {built_in}; or give the path of a .toml file")
    return Path(text)
