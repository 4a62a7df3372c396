"""Reference pages made from the program itself."""

from pathlib import Path

import against_the_paper
import looks
import record_keys

from daq_app.cli import main
from daq_app.qt import start


def write(folder: Path) -> None:
    """Write every generated page into `folder`, and remove all others."""
    folder.mkdir(parents=True, exist_ok=True)
    pages = {
        "command-line": command_line(),
        "against-the-paper": against_the_paper.page(),
        "looks": looks.page(),
        **record_keys.pages(),
    }
    looks.write_pictures(folder)
    for file in folder.glob("*.md"):  # a page of an earlier version is in no table of contents
        if file.stem not in pages:
            file.unlink()
    for name, text in pages.items():
        file = folder / f"{name}.md"
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def command_line() -> str:
    """Return the help of every verb, as argparse prints it."""
    lines = ["# Command line", "", "`daq-app VERB --help` prints the same.", ""]
    parsers = [("window", "open the window, which `daq-app` alone does too", start.command_line())]
    for name, summary in main.VERBS.items():
        parsers.append((name, summary, main.parser_of(name, main.verb_module(name))))
    for name, summary, parser in parsers:
        text = parser.format_help().rstrip()
        lines += [f"## {name}", "", f"{summary[0].upper()}{summary[1:]}.", "", "```text", text, "```", ""]
    return "\n".join(lines)
