"""The command line: verbs, exit codes, and the one sentence of a failure."""

import argparse
import importlib
import sys
import traceback
from types import ModuleType

from daq_app.console import (
    DONE,
    FAILED,
    FLAWED,
    STOPPED,
    WRONG,
    Console,
    Parser,
    RecordingKept,
    accept_any_text,
    is_ours,
)

_HELP = frozenset({"-h", "--help"})
_LONGEST = 1500  # of the sentence of a failure [characters]: half a page of a terminal

# Verb to its one-line help. A verb's module is imported only when it is run.
VERBS = {
    "demo": "run the whole study on the simulated transducer and simulated subjects",
    "devices": "list the transducers that can be reached, or probe one",
    "run": "run one session",
    "enrol": "enrol a subject in a study, or make one",
    "resume": "resume a session that was cut short",
    "import": "make a session folder from a foreign recording",
    "replay": "run a recorded session again and compare the results",
    "analyse": "find the strokes of a session and their friction",
    "decide": "record a person's decision about a stroke, or undo it",
    "predict": "predict the receptor's strain-energy density for each trial",
    "fit-finger": "fit the stiffnesses of a subject's own finger to presses of known displacement",
    "solve": "run the solver on a scene file",
    "sensitivity": "show which of a scene's numbers affect the SED, or on which fingers a response keeps its sign",
    "accuracy": "measure the solver's speed and accuracy on this machine, and write one page",
    "report": "write a session's report as one page",
    "study": "pool many sessions: group statistics, a page, a table of all trials",
    "translate": "write the file that a translator fills in",
    "export": "write a session for other programs",
    "selftest": "test crash safety on this computer and disk, and write a certificate",
    "simulate": "serve a simulated device, to try a driver without hardware",
    "unblind": "open the sealed key of a blinded study or session",
    "verify": "check every checksum of a session and recompute every derived number",
}


# Errors of the command line or of a value in a file (exit code 2); other exceptions of the program have exit code 1.
_WRONG = (
    "daq_app.console.WrongValue",
    "drivers.address.AddressError",
    "sessions.strokes.decisions.DecisionError",
    "sessions.toml_file.SettingsError",
    "simulators.serving.TimetableError",
    "solver.scene.tables.SceneError",
)


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code. Never raises, except for a broken interpreter."""
    debug = "--debug" in arguments
    try:
        accept_any_text(sys.stdin, sys.stdout, sys.stderr)
        return _dispatch(arguments)
    except KeyboardInterrupt as stop:
        return _report(str(stop) or "stopped", FLAWED if isinstance(stop, RecordingKept) else STOPPED)
    except BrokenPipeError:
        return FAILED  # the reader of our output has gone
    except Exception as error:  # noqa: BLE001  no traceback may reach a user
        if debug:
            traceback.print_exc()
        return _report(*_failure(error))


def _dispatch(arguments: list[str]) -> int:
    if not arguments:
        Console(as_json=False).note(_overview().format_help().rstrip())
        return WRONG
    name, *verb_arguments = arguments
    if name in _HELP:
        _overview().print_help()
        return DONE
    if name == "--version":
        from sessions.recording.head import software_versions  # here, because no verb needs it earlier

        Console(as_json=False).say(f"daq-app {software_versions()['daq-app']}")
        return DONE
    if name not in VERBS:
        return _report(f"there is no verb '{name}': 'daq-app --help' lists the verbs", WRONG)
    verb = verb_module(name)
    parser = parser_of(name, verb)
    if _HELP & {*verb_arguments}:
        parser.print_help()
        return DONE
    options = parser.parse_args(_join_values(verb_arguments))
    console = Console(as_json=options.json)
    try:
        return console.exit_code(verb.run(options, console))
    except RecordingKept as ending:
        console.result(**ending.document)
        raise


def _join_values(arguments: list[str]) -> list[str]:
    """Join --normal and --axes to their values, which may begin with a hyphen and would be taken for an option.

    >>> _join_values(["a.csv", "--normal", "-z", "--axes", "-,t"])
    ['a.csv', '--normal=-z', '--axes=-,t']
    """
    for name in {"--normal", "--axes"} & {*arguments[:-1]}:
        index = arguments.index(name)
        arguments = [*arguments[:index], f"{name}={arguments[index + 1]}", *arguments[index + 2 :]]
    return arguments


def _overview() -> argparse.ArgumentParser:
    width = max(map(len, VERBS))
    verbs = "\n".join(f"  {name:<{width}}  {summary}" for name, summary in VERBS.items())
    return Parser(
        prog="daq-app",
        usage="daq-app VERB [options]",
        description="Friction psychophysics: the experiment, the transducer, the finite-element finger.",
        epilog=f"verbs:\n{verbs}\n\n'daq-app VERB --help' explains a verb and shows an example. "
        "'daq-app' alone opens the window, 'daq-app window SESSION' a session in it. "
        "'daq-app --version' prints the program's version.\n\n"
        "exit codes: 0 done, 1 could not be done, 2 wrong command line or value in a TOML file, "
        "3 done with named losses or flaws, 130 stopped",
    )


def verb_module(name: str) -> ModuleType:
    """Return the module of a verb."""
    return importlib.import_module(f"daq_app.cli.verbs.{name.replace('import', 'import_').replace('-', '_')}")


def parser_of(name: str, verb: ModuleType) -> argparse.ArgumentParser:
    """Return the parser of a verb's command line."""
    parser = Parser(
        prog=f"daq-app {name}",
        description=verb.__doc__,
        epilog=f"example:\n  {verb.EXAMPLE}",
        allow_abbrev=False,
    )
    verb.add_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON document on stdout, and nothing else")
    parser.add_argument("--debug", action="store_true", help="show the traceback of a failure")
    return parser


def _failure(error: Exception) -> tuple[str, int]:
    sentence = " ".join(str(error).split())
    if len(sentence) > _LONGEST:  # the middle comes from a damaged file
        sentence = f"{sentence[: _LONGEST // 2]} … {sentence[-_LONGEST // 2 :]}"
    if any(f"{base.__module__}.{base.__qualname__}" in _WRONG for base in type(error).__mro__):
        return sentence, WRONG
    if sentence and is_ours(type(error).__module__):
        return sentence, FAILED
    if isinstance(error, OSError):
        from sessions.file_access import failure_sentence  # here, because only a failing verb needs it

        return sentence if error.filename is None else failure_sentence(error), FAILED
    if isinstance(error, UnicodeEncodeError):  # Python holds non-UTF-8 bytes of a name as lone surrogates
        around = error.object[max(error.start - 40, 0) : error.end + 20]
        return f"a name is not UTF-8 ({around!r}): rename the file or folder and run this again", FAILED
    if isinstance(error, ModuleNotFoundError) and error.name and not is_ours(error.name):
        package = error.name.partition(".")[0]
        return f"the Python package {package} is not installed; 'pip install daq-app' installs it", FAILED
    return f"unexpected {type(error).__name__} ({sentence}); run again with --debug and report the output", FAILED


def _report(sentence: str, code: int) -> int:
    Console(as_json=False).note(f"daq-app: {sentence}")
    return code
