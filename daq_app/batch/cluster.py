"""What one session brings to a study, computed where it lies, or from its files by workers of a Dask cluster."""

import asyncio
import importlib
import logging
import tempfile
import time
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

from sessions.prediction.sealed_predictions import SEAL
from sessions.recording import Recording
from sessions.recording.derived import GAIN_ERROR, UNBLINDING
from sessions.recording.head import software_versions
from sessions.recording.schema import LIVE_FILE
from sessions.statistics.pooling.visit import VisitOptions, visit_of
from sessions.strokes.decisions import DECISIONS

LOOK = 0.1  # between two looks whether something is done [s]
WITHOUT_WORKERS = 30.0  # that a cluster may have no worker before it is given up [s]
ANSWERS = 20.0  # that a scheduler may take to answer [s]
AGAIN = "run this again once it is there: what is done is kept"
NUMBERS_BY = ("daq-app", "numpy", "scipy", "numba")  # whose other versions may give other numbers
# All that a visit's numbers come from.
CONTENT = (LIVE_FILE, f"{LIVE_FILE}-wal", UNBLINDING, SEAL, DECISIONS, GAIN_ERROR)

Answer = tuple[str, dict[str, Any] | str]  # session, and what it brings or why it brings nothing


def content_of(session: Path) -> dict[str, bytes]:
    """Return the files of a session that its numbers come from. Raises OSError."""
    return {name: (session / name).read_bytes() for name in CONTENT if (session / name).is_file()}


def computed(folder: Path, options: VisitOptions) -> Answer:
    """Return what the session in a folder brings; for a worker: nothing is raised."""
    try:
        return folder.name, asdict(visit_of(Recording.open(folder), options, software_versions()))
    except Exception as error:  # noqa: BLE001  one bad session must not stop the rest
        sentence = " ".join(str(error).split()) or type(error).__name__
        return folder.name, sentence.replace(str(folder), folder.name)  # the same wherever it was computed


def computed_from(name: str, content: Mapping[str, bytes], options: VisitOptions) -> Answer:
    """Return what a session brings whose files were sent: a worker needs no disk in common with us."""
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / name
        folder.mkdir()
        for file, data in content.items():
            (folder / file).write_bytes(data)
        return computed(folder, options)


class SchedulerError(Exception):
    """The cluster cannot be used: why, and what to do."""


@contextmanager
def cluster_client(address: str) -> Generator[Any]:
    """Give a client of the scheduler at an address. Raises SchedulerError where none answers, or it goes meanwhile."""
    try:
        library: Any = importlib.import_module("distributed")
    except ImportError as error:
        raise SchedulerError("a cluster needs the package distributed: pip install 'daq-app[cluster]'") from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # a sentence below says what it logs as errors
    security: Any = library.Security()  # certificates as Dask's own configuration names them, for tls:// addresses
    kind = asyncio.run(_identity(library, address, security))
    if kind != "Scheduler":
        raise SchedulerError(f"{address} is the address of a Dask {kind.lower()}: give that of its scheduler")
    client: Any = library.Client(address, timeout=ANSWERS, set_as_default=False, security=security)
    try:
        yield client
    except OSError as error:
        raise SchedulerError(f"{address}: the scheduler is gone ({error}); {AGAIN}") from error
    finally:
        with suppress(OSError, TimeoutError):  # it may be gone
            client.close()


def by_cluster(folders: Sequence[Path], options: VisitOptions, address: str) -> Iterator[Answer]:
    """Yield answers as they come, from the workers of a cluster. Raises SchedulerError."""
    with cluster_client(address) as client:
        answers = importlib.import_module("distributed").as_completed(loop=client.loop)
        yield from _by_client(client, answers, folders, options, address)


def refuse_other_versions(answer: Answer, address: str) -> None:
    """Raise SchedulerError for what was computed by other versions: one study holds the numbers of one program."""
    if not isinstance(answer[1], str):
        _refuse_unlike(answer[1]["made_by"], address, "a worker")


def refuse_other_workers(client: Any, workers: Sequence[str], address: str) -> None:  # noqa: ANN401
    """Raise SchedulerError where one of the workers at some addresses would compute with other versions, or cannot.

    A worker that has gone by now says nothing.
    """
    answers: dict[str, Any] = client.run(software_versions, workers=list(workers), on_error="return")
    for worker, versions in answers.items():
        if isinstance(versions, ImportError):
            raise SchedulerError(
                f"{address}: the worker {worker} has no daq-app ({versions}); install it there, in the version that "
                "is here, and run this again: what is done is kept"
            )
        if isinstance(versions, dict):
            _refuse_unlike(cast("dict[str, str]", versions), address, f"the worker {worker}")


def _refuse_unlike(there: Mapping[str, Any], address: str, who: str) -> None:
    here = software_versions()
    differ = [name for name in NUMBERS_BY if there.get(name) != here.get(name)]
    if differ:
        other = ", ".join(f"{name} {there.get(name)} (here {here.get(name)})" for name in differ)
        raise SchedulerError(
            f"{address}: {who} computes with {other}; give every worker the versions that are here and "
            "run this again: what is done is kept"
        )


async def _identity(library: Any, address: str, security: Any) -> str:  # noqa: ANN401 - distributed declares no types
    """Return what answers at an address. Raises SchedulerError: a client alone waits for ever for what keeps silent."""
    try:
        secured = security.get_connection_args("client")
        async with asyncio.timeout(ANSWERS), library.rpc(address, timeout=ANSWERS, connection_args=secured) as there:
            return str((await there.identity())["type"])
    except Exception as error:  # any program may listen there and answer anything
        why = " ".join(str(error).split()) or f"nothing within {ANSWERS:.0f} s"
        raise SchedulerError(
            f"{address}: no Dask scheduler answers there ({why}); start one, or give no address"
        ) from error


def _by_client(
    client: Any,  # noqa: ANN401
    answers: Any,  # noqa: ANN401
    folders: Sequence[Path],
    options: VisitOptions,
    address: str,
) -> Iterator[Answer]:
    """Yield answers as they come to a client of the cluster."""
    names: dict[Any, str] = {}
    waiting = list(reversed(folders))
    under_way: dict[str, Any] = {}
    checked = set[str]()  # workers whose versions are ours
    seen = time.monotonic()  # when a worker was last there
    try:
        while waiting or under_way:
            there: dict[str, int] = client.nthreads()
            threads = sum(there.values())
            joined = [worker for worker in there if worker not in checked]
            if joined:  # before it is given anything to compute, also where it comes later
                refuse_other_workers(client, joined, address)
                checked.update(joined)
            seen = time.monotonic() if threads else seen
            if time.monotonic() - seen > WITHOUT_WORKERS:
                raise SchedulerError(
                    f"{address}: the scheduler has had no worker for {WITHOUT_WORKERS:.0f} s; start some and run this "
                    "again: what is done is kept"
                )
            # Files are read and sent as workers come free: never those of a thousand sessions at once.
            while waiting and threads and len(under_way) < 2 * threads:
                folder = waiting.pop()
                future = client.submit(computed_from, folder.name, content_of(folder), options, pure=False, retries=1)
                names[future.key], under_way[future.key] = folder.name, future
                answers.add(future)
            if not answers.has_ready():
                time.sleep(LOOK)
                continue
            future = next(answers)
            if future.cancelled():  # nobody cancels but a client that has lost its scheduler
                raise ConnectionError("the connection was lost")
            del under_way[future.key]
            if future.status == "finished":
                answer: Answer = future.result()
                refuse_other_versions(answer, address)
                yield answer
            else:
                yield names[future.key], f"no worker could compute it ({future.exception()})"
    finally:
        with suppress(OSError, TimeoutError):  # the scheduler may be gone
            client.cancel(list(under_way.values()))
