"""What subjects read in other languages than the protocol's own: a table for each block and language."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from sessions.toml_file import NotAllowed, check, check_scale_ends, check_text

PRE_EVALUATION = "pre-evaluation"  # the name under which the instruction of that phase is translated
ENGLISH = "en"


@dataclass(frozen=True, slots=True)
class Translation:
    """The texts of one block in one language; it has those that the block has."""

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


def check_translations(
    translations: Sequence[Translation],
    blocks: Mapping[str, tuple[str, str] | None],
    original: str,
    *,
    pre_evaluation: bool,
) -> None:
    """Raise NotAllowed unless each language has every text of a protocol once, and none that it has not.

    `blocks` holds by name what the ends of a block's line are called; None where it has no line.
    """
    names = [*blocks, *([PRE_EVALUATION] if pre_evaluation else [])]
    for number, translation in enumerate(translations):
        key, block, ends = f"translations[{number}]", translation.block, translation.scale_ends
        is_other = translation.language != original
        check(is_other, f"{key}.language", original, "it is the protocol's own: its texts stand in the blocks")
        check(block in names, f"{key}.block", block, f"it must be one of {', '.join(names)}")
        earlier = {(translation.language, translation.block) for translation in translations[:number]}
        is_new = (translation.language, block) not in earlier
        check(is_new, f"{key}.block", block, f'"{translation.language}" has its texts already')
        if (ends is None) != (blocks.get(block) is None):
            remedy = "name both ends of its line" if ends is None else "it has no line: leave its ends out"
            raise NotAllowed(f"{key}.scale_ends", ends and list(ends), remedy)
        if block in blocks and not translation.question.strip():
            raise NotAllowed(f"{key}.question", translation.question, f"say what is asked of {block} in this language")
    for language, block in missing_texts(translations, names):
        raise NotAllowed("translations", language, f'the texts of {block} are missing in "{language}"')


def missing_texts(translations: Sequence[Translation], names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield language and block of each text that a language which has others lacks."""
    for language in languages_of(translations):
        blocks = {translation.block for translation in translations if translation.language == language}
        yield from ((language, name) for name in names if name not in blocks)


def languages_of(translations: Sequence[Translation]) -> tuple[str, ...]:
    """Return the languages, in the order first met."""
    return tuple(dict.fromkeys(translation.language for translation in translations))
