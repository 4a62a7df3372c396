"""Many sessions computed at once, on this computer's cores or a Dask cluster, each kept as soon as it is done."""

import asyncio
import hashlib
import importlib
import json
import logging
import multiprocessing
import os
import signal
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from daq_app.console import Console
from sessions.blinding import UNBLINDING
from sessions.decisions import DECISIONS
from sessions.gain_error import GAIN_ERROR
from sessions.pooling.visit import FORM, Visit, VisitOptions, visit_of
from sessions.recording import Recording, RecordingError
from sessions.recording.provenance import software_versions
from sessions.recording.schema import LIVE_FILE
from sessions.recording.whole_file import write_whole
from sessions.sealing import SEAL

LOOK = 0.1  # between two looks whether something is done [s]
WITHOUT_WORKERS = 30.0  # that a cluster may have no worker before it is given up [s]
ANSWERS = 20.0  # that a scheduler may take to answer [s]
AGAIN = "run this again once it is there: what is done is kept"
# All that a visit's numbers come from.
CONTENT = (LIVE_FILE, f"{LIVE_FILE}-wal", UNBLINDING, SEAL, DECISIONS, GAIN_ERROR)

Answer = tuple[str, dict[str, Any] | str]  # session, and what it brings or why it brings nothing


class SchedulerError(Exception):
    """The cluster cannot be used: why, and what to do."""


class Shelf:
    """Results by the content they were made of: the same recording, options and versions give the same key."""

    def __init__(self, folder: Path, options: VisitOptions) -> None:
        """Keep results in `folder`, which is made when the first comes."""
        self._folder = folder
        made = {"form": FORM, "options": asdict(options), "versions": software_versions()}
        self._made = json.dumps(made, sort_keys=True, default=str).encode()

    def key(self, session: Path) -> str:
        """Return the SHA-256 over all that a session's result comes from. Raises OSError."""
        digest = hashlib.sha256(self._made)
        digest.update(session.name.encode())
        for name, content in content_of(session).items():
            digest.update(f"\0{name}\0{len(content)}\0".encode() + content)
        return digest.hexdigest()

    def found(self, key: str) -> Visit | None:
        """Return what was kept under a key; None where nothing was, or it is not what was written."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            kept = json.loads(self.file(key).read_bytes())
            if kept["sha256"] == _digest(kept["visit"]):
                return Visit.from_dict(kept["visit"])
        return None

    def file(self, key: str) -> Path:
        """Return where a result is kept."""
        return self._folder / f"{key}.json"

    def keep(self, key: str, result: Mapping[str, Any]) -> None:
        """Keep a result. Raises RecordingError where it cannot be written."""
        text = json.dumps({"sha256": _digest(result), "visit": result}, ensure_ascii=False, allow_nan=False)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_whole(self.file(key), text.encode() + b"\n")
        except OSError as error:
            why = f"{self._folder} cannot be written ({error.strerror}): make room on its disk"
            raise RecordingError(f"{why} and run this again: what is done is kept") from error


def _digest(result: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()


def content_of(session: Path) -> dict[str, bytes]:
    """Return the files of a session that its numbers come from. Raises OSError."""
    return {name: (session / name).read_bytes() for name in CONTENT if (session / name).is_file()}


def visits(
    folders: Sequence[Path],
    options: VisitOptions,
    shelf: Shelf,
    console: Console,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
) -> tuple[list[Visit], list[tuple[str, str]]]:
    """Return what each session brings, and the name of and the reason for each that brings nothing.

    What is on the shelf already is not computed again; what is done stays there whatever comes. Raises SchedulerError,
    RecordingError where the shelf cannot be written.
    """
    keys = {folder: shelf.key(folder) for folder in folders}
    kept = {folder: shelf.found(key) for folder, key in keys.items()}
    done = [visit for visit in kept.values() if visit is not None]
    missing = [folder for folder, visit in kept.items() if visit is None]
    for folder in missing:
        if shelf.file(keys[folder]).exists():
            console.note(f"{folder.name}: {shelf.file(keys[folder])} is damaged; the session is computed anew")
    if done:
        console.note(f"{len(done)} of {len(folders)} sessions were computed before and are taken as they are")
    failed: list[tuple[str, str]] = []
    named = {folder.name: keys[folder] for folder in missing}
    begun = time.monotonic()
    if missing:
        console.progress(0.0, f"0 of {len(missing)} sessions")
    here = scheduler is None or not missing
    answers = _local(missing, options, workers) if here else _dask(missing, options, scheduler or "")
    try:
        for count, (name, answer) in enumerate(answers, 1):
            if isinstance(answer, str):
                failed.append((name, answer))
                console.note(f"{name}: {answer}")
            else:
                shelf.keep(named[name], answer)
                done.append(Visit.from_dict(answer))
            left = (time.monotonic() - begun) / count * (len(missing) - count)
            console.progress(0.95 * count / len(missing), f"{count} of {len(missing)} sessions, {left:.0f} s left")
    except KeyboardInterrupt:
        console.note(f"{len(done)} of {len(folders)} sessions are computed and kept; the next run goes on from there")
        raise
    return done, failed


def computed(folder: Path, options: VisitOptions) -> Answer:
    """Return what the session in a folder brings; for a worker: nothing is raised."""
    try:
        return folder.name, visit_of(Recording.open(folder), options, software_versions()).to_dict()
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


def _local(folders: Sequence[Path], options: VisitOptions, workers: int | None) -> Iterator[Answer]:
    """Yield answers as they come, from processes of this computer."""
    if not folders:
        return
    left = {folder.name: folder for folder in folders}
    count = workers or min(os.cpu_count() or 1, len(folders))
    try:
        for answer in _in_pool(list(left.values()), options, count):
            del left[answer[0]]
            yield answer
    except BrokenProcessPool:  # a worker died, and nobody knows over which session: each gets a worker of its own
        for folder in list(left.values()):
            try:
                yield from _in_pool([folder], options, 1)
            except BrokenProcessPool:
                yield folder.name, "the process that computed it died, perhaps for want of memory"


def _in_pool(folders: Sequence[Path], options: VisitOptions, workers: int) -> Iterator[Answer]:
    # Threads of the linear algebra would change the last bits, and cost more than they bring at these sizes.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    fresh = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=fresh, initializer=_attend)
    try:
        waiting: set[Future[Answer]] = {pool.submit(computed, folder, options) for folder in folders}
        while waiting:
            ready, waiting = wait(waiting, LOOK, FIRST_COMPLETED)
            for future in ready:
                yield future.result()
        pool.shutdown()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        ended = multiprocessing.active_children()
        for process in ended:
            process.kill()  # they hold nothing that is not computed again
        for process in ended:
            process.join(LOOK)
        raise


def _attend() -> None:
    """Leave Ctrl-C to the process that was asked to stop, and end where that one was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)  # nobody is left to hand anything to


def _dask(folders: Sequence[Path], options: VisitOptions, address: str) -> Iterator[Answer]:
    """Yield answers as they come, from the workers of a cluster. Raises SchedulerError."""
    try:
        library: Any = importlib.import_module("distributed")
    except ImportError as error:
        raise SchedulerError("a cluster needs the package distributed: pip install 'daq-app[cluster]'") from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it logs as errors is told in a sentence below
    kind = asyncio.run(_identity(library, address))
    if kind != "Scheduler":
        raise SchedulerError(f"{address} is the address of a Dask {kind.lower()}: give that of its scheduler")
    client: Any = library.Client(address, timeout=ANSWERS, set_as_default=False)
    try:
        yield from _by_client(client, library.as_completed(loop=client.loop), folders, options, address)
    except OSError as error:
        raise SchedulerError(f"{address}: the scheduler is gone ({error}); {AGAIN}") from error
    finally:
        with suppress(OSError, TimeoutError):  # it may be gone
            client.close()


async def _identity(library: Any, address: str) -> str:  # noqa: ANN401 - distributed declares no types
    """Return what answers at an address. Raises SchedulerError: a client alone waits for ever for what keeps silent."""
    try:
        async with asyncio.timeout(ANSWERS), library.rpc(address, timeout=ANSWERS) as there:
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
    seen = time.monotonic()  # when a worker was last there
    try:
        while waiting or under_way:
            threads = sum(client.nthreads().values())
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
                yield future.result()
            else:
                yield names[future.key], f"no worker could compute it ({future.exception()})"
    finally:
        with suppress(OSError, TimeoutError):  # the scheduler may be gone
            client.cancel(list(under_way.values()))
