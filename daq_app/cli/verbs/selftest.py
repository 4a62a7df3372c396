"""Pull the program's own plug on this computer and this disk, and write a dated certificate of what came of it.

In a folder of its own it kills its recorder, cuts the end off its log, fills the room it has, and stops it. Sessions
recorded below the folder DIR later carry the certificate. It takes less than a minute.
"""

import argparse
import shutil
import tempfile
from pathlib import Path

from daq_app.console import DONE, FLAWED, Console
from daq_app.recorder.selftest import SelfTestFailed, selftest
from sessions.recording.head import write_certificate
from sessions.recording.storage import unsafe

EXAMPLE = "daq-app selftest --out recordings"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", type=Path, metavar="DIR", default=Path("recordings"), help="where sessions will be (recordings/)"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    warning = unsafe(out)
    room = Path(tempfile.mkdtemp(prefix="selftest-", dir=out))
    try:
        certificate = selftest(room, console.progress)
    except SelfTestFailed as failure:
        console.result({"passed": False, "sentence": str(failure), "left_in": str(room)})
        console.say(f"FAILED: {failure}. What is left of it lies in {room}; report it")
        return FLAWED
    except KeyboardInterrupt:
        shutil.rmtree(room, ignore_errors=True)
        raise
    shutil.rmtree(room)
    path = write_certificate(out, certificate)
    console.result({"passed": True, "certificate": str(path), "warning": warning, **certificate})
    console.say(certificate["sentence"])
    console.note(None if warning is None else f"all the same, {warning}")
    console.say(f"certificate  {path}")
    return DONE if warning is None else FLAWED
