"""Write the file that a translator fills in: a protocol's texts as TOML tables, or the program's own as XLIFF.

Texts that are already translated are kept; untranslated texts stay in the source language. Append the tables to the
protocol's file. Edit an XLIFF file with Qt Linguist, another editor of XLIFF or as text; the window reads it directly.
"""

import argparse
import ast
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree

from daq_app.console import DONE, Console, WrongValue
from daq_app.window.subject import SubjectText, usual_question
from daq_app.wording import EXPERIMENTER, SUBJECT, translations
from sessions.file_access import NotOurs, name_failure, write_whole
from sessions.plan.protocols.protocol import ENGLISH, PRE_EVALUATION, Protocol, Translation, check_language, protocol
from sessions.prediction import QUANTITIES
from sessions.recording import RecordingError
from sessions.report.wording import shown_response
from sessions.toml_file import toml_text
from solver.quantities import FIELDS

EXAMPLE = "daq-app translate sensotact-friction --language nl --out dutch.toml"
PROGRAM = Path(__file__).parents[2]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("protocol", nargs="?", metavar="PROTOCOL", help="a built-in protocol, or a TOML file")
    parser.add_argument("--program", action="store_true", help="the texts of the subject's page instead")
    parser.add_argument("--window", action="store_true", help="the texts of the experimenter's windows instead")
    meaning = "ISO 639 code of the language, in two or three small letters"
    parser.add_argument("--language", required=True, metavar="XX", help=meaning)
    parser.add_argument("--out", type=Path, metavar="FILE", help="a new file (the terminal)")


def run(options: argparse.Namespace, console: Console) -> int:
    if (options.protocol is not None) + options.program + options.window != 1:
        raise WrongValue("give one of PROTOCOL, --program or --window")
    check_language("--language", options.language)
    if options.window:
        text, gaps = program_texts(EXPERIMENTER, window_texts(), options.language)
    elif options.program:
        text, gaps = program_texts(SUBJECT, SubjectText, options.language)
    else:
        text, gaps = protocol_texts(protocol(options.protocol), options.language)
    if options.out is None:
        console.say(text.rstrip())
    else:
        if options.out.exists():
            raise NotOurs(f"{options.out} is there already: give a new file, or move that away")
        with name_failure(RecordingError, f"{options.out} cannot be written", new=True):
            write_whole(options.out, text.encode())
    destination = {"out": None, "text": text} if options.out is None else {"out": str(options.out)}
    console.result(language=options.language, missing=gaps, **destination)
    unit = "texts" if options.program or options.window else "tables"
    console.note(f"{unit} yet to be translated: {gaps}" if gaps else "every text is translated")
    return DONE


def protocol_texts(source: Protocol, language: str) -> tuple[str, int]:
    """Return a language's tables, and the number of untranslated blocks. Raises WrongValue for the protocol's own."""
    if language == source.language:
        raise WrongValue(f"--language {language} is the protocol's own: its texts are in the blocks")
    earlier = {text.block: text for text in source.translations if text.language == language}
    before = source.pre_evaluation
    texts = [] if before is None else [Translation(language, PRE_EVALUATION, before.instruction)]
    for block in source.blocks:
        question = block.question or usual_question(block.descriptor)
        texts.append(Translation(language, block.name, block.instruction, block.scale_ends, question))
    lines: list[str] = []
    for text in texts:
        mark = "" if text.block in earlier else f"# to be translated from {source.language}\n"
        table = toml_text(earlier.get(text.block, text)).replace('question = ""\n', "")
        lines.append(f"[[translations]]\n{mark}{table}")
    return "\n".join(lines), sum(text.block not in earlier for text in texts)


def window_texts() -> list[str]:
    """Return every text of the experimenter's windows as in the sources, and those of fields and quantities."""
    labels = (*(field.label for field in FIELDS), *(shown_response(quantity.name).label for quantity in QUANTITIES))
    texts = dict.fromkeys(labels)
    for source in sorted(PROGRAM.rglob("*.py")):
        for node in ast.walk(ast.parse(source.read_text("utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("tr", "tr_noop"):
                constants = (part for part in ast.walk(node.args[0]) if isinstance(part, ast.Constant))
                texts |= dict.fromkeys(constant.value for constant in constants if isinstance(constant.value, str))
    return list(texts)


def program_texts(context: str, texts: Iterable[str], language: str) -> tuple[str, int]:
    """Return the XLIFF file of a language, and the number of untranslated texts."""
    earlier = translations(context, language)
    root = ElementTree.Element("xliff", version="1.2", xmlns="urn:oasis:names:tc:xliff:document:1.2")
    about = {"original": context, "datatype": "plaintext", "source-language": ENGLISH, "target-language": language}
    units = ElementTree.SubElement(ElementTree.SubElement(root, "file", about), "body")
    gaps = 0
    for number, text in enumerate(texts, 1):
        unit = ElementTree.SubElement(units, "trans-unit", id=str(number))
        ElementTree.SubElement(unit, "source").text = text
        target = ElementTree.SubElement(unit, "target")
        target.text = earlier.get(text, "")
        if target.text:
            unit.set("approved", "yes")
        else:
            target.set("state", "needs-translation")
            gaps += 1
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{body}\n', gaps
