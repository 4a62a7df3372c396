"""Parallel computation of many sessions, on local cores or a Dask cluster, each kept as soon as it is done."""

import asyncio
import hashlib
import importlib
import json
import logging
import multiprocessing
import os
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar, cast

from daq_app.child_process import process_pool
from daq_app.console import Console
from sessions.file_access import as_type, json_object, name_failure, remedy, write_whole
from sessions.prediction.sealed_predictions import SEAL
from sessions.recording import Recording, RecordingError
from sessions.recording.derived import GAIN_ERROR, UNBLINDING
from sessions.recording.head import software_versions
from sessions.recording.schema import LIVE_FILE
from sessions.statistics.visit import FORM, Visit, VisitOptions, visit_of
from sessions.strokes.decisions import DECISIONS

_LOOK = 0.1  # between two polls for finished work [s]
WITHOUT_WORKERS = 30.0  # longest time of a cluster without workers [s]
_ANSWERS = 20.0  # longest time for a scheduler to answer [s]
AGAIN = "run this again once it is there: finished results are kept"
NUMBERS_BY = ("daq-app", "numpy", "scipy", "numba")  # other versions of these may give other numbers
# All files that a visit's numbers depend on.
CONTENT = (LIVE_FILE, f"{LIVE_FILE}-wal", UNBLINDING, SEAL, DECISIONS, GAIN_ERROR)

A = TypeVar("A")
Jobs = Mapping[str, tuple[Any, ...]]  # arguments of each job, by its name
Answer = dict[str, Any] | str  # a session's result, or why it has none


class Lost(str):
    """The reason why a job was not done."""


def content_of(session: Path) -> dict[str, bytes]:
    """Return the content of the files that a session's numbers depend on, by name. Raises RecordingError."""
    with name_failure(RecordingError, "its files cannot be read"):
        return {name: (session / name).read_bytes() for name in CONTENT if (session / name).is_file()}


def compute_visit(folder: Path, options: VisitOptions) -> Answer:
    """Return the result of the session in a folder; never raises, since it runs in a worker."""
    try:
        return asdict(visit_of(Recording.open(folder), options, software_versions()))
    except Exception as error:  # noqa: BLE001  one bad session must not stop the rest
        sentence = " ".join(str(error).split()) or type(error).__name__
        return sentence.replace(str(folder), folder.name)  # independent of where it was computed


def _contents(folder: Path, options: VisitOptions) -> tuple[Any, ...]:
    return folder.name, content_of(folder), options


def compute_sent_visit(name: str, content: Mapping[str, bytes], options: VisitOptions) -> Answer:
    """Return the result of a session whose files were sent, so that a worker needs no shared disk."""
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / name
        folder.mkdir()
        for file, data in content.items():
            (folder / file).write_bytes(data)
        return compute_visit(folder, options)


class SchedulerError(Exception):
    """The cluster cannot be used: why, and what to do."""


@contextmanager
def cluster_client(address: str) -> Generator[Any]:
    """Yield a client of the scheduler at an address. Raises SchedulerError if none answers, or if it goes."""
    try:
        library: Any = importlib.import_module("distributed")
    except ImportError as error:
        raise SchedulerError("a cluster needs the package distributed: pip install 'daq-app[cluster]'") from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # reported below as one sentence
    security: Any = library.Security()  # certificates as Dask's own configuration names them, for tls:// addresses
    server_type = asyncio.run(_identity(library, address, security))
    if server_type != "Scheduler":
        raise SchedulerError(f"{address} is the address of a Dask {server_type.lower()}: give that of its scheduler")
    client: Any = library.Client(address, timeout=_ANSWERS, set_as_default=False, security=security)
    try:
        yield client
    except OSError as error:
        raise SchedulerError(f"{address}: the scheduler is gone ({error}); {AGAIN}") from error
    finally:
        with suppress(OSError, TimeoutError):  # it may be gone
            client.close()


def by_cluster(
    work: Callable[..., A],
    jobs: Jobs,
    address: str,
    prepare: Callable[..., tuple[Any, ...]] = lambda *arguments: arguments,  # pyrefly: ignore[implicit-any-lambda]
) -> Generator[tuple[str, A | Lost]]:
    """Yield each job's name and the result of `work`, as they come from the workers of a cluster.

    `prepare` converts a job's arguments just before they are sent. Closing the generator cancels jobs under way.
    Raises SchedulerError.
    """
    with cluster_client(address) as client:
        answers: Any = importlib.import_module("distributed").as_completed(loop=client.loop)
        queue = list(jobs)[::-1]
        under_way: dict[Any, str] = {}  # by the cluster's key
        compatible = set[str]()  # workers with our versions
        last_worker_time = time.monotonic()  # when there was last a worker
        while queue or under_way:
            crew: dict[str, int] = client.nthreads()
            threads = sum(crew.values())
            newcomers = [worker for worker in crew if worker not in compatible]
            if newcomers:  # before they compute anything, even if they join later
                refuse_other_workers(client, newcomers, address)
                compatible.update(newcomers)
            last_worker_time = time.monotonic() if threads else last_worker_time
            if time.monotonic() - last_worker_time > WITHOUT_WORKERS:
                idle = f"{address}: the scheduler has had no worker for {WITHOUT_WORKERS:.0f} s"
                raise SchedulerError(f"{idle}; start some and run this again: finished results are kept")
            # Files are read and sent as workers become free, so that memory never holds those of all sessions.
            while queue and threads and len(under_way) < 2 * threads:
                name = queue.pop()
                try:
                    arguments = prepare(*jobs[name])
                except RecordingError as error:
                    yield name, Lost(str(error))
                    continue
                future = client.submit(work, *arguments, pure=False, retries=1)
                under_way[future.key] = name
                answers.add(future)
            if not answers.has_ready():
                time.sleep(_LOOK)
                continue
            future = next(answers)
            if future.cancelled():  # only a client that has lost its scheduler cancels
                raise ConnectionError("the connection was lost")
            name, success = under_way.pop(future.key), future.status == "finished"
            yield name, future.result() if success else Lost(f"no worker could compute it ({future.exception()})")


def refuse_other_workers(client: Any, workers: Sequence[str], address: str) -> None:  # noqa: ANN401
    """Raise SchedulerError if a worker has other versions, or cannot compute; ignore one that has gone."""
    answers: dict[str, Any] = client.run(software_versions, workers=list(workers), on_error="return")
    for worker, versions in answers.items():
        if isinstance(versions, ImportError):
            raise SchedulerError(
                f"{address}: the worker {worker} has no daq-app ({versions}); install it there, in the version that "
                "is here, and run this again: finished results are kept"
            )
        if isinstance(versions, dict):
            refuse_unlike(cast("dict[str, str]", versions), address, f"the worker {worker}")


def refuse_unlike(versions: Mapping[str, Any], address: str, worker_name: str) -> None:
    """Raise SchedulerError for results of other versions, so that one study holds the numbers of one program."""
    present = software_versions()
    differ = [name for name in NUMBERS_BY if versions.get(name) != present.get(name)]
    if differ:
        unlike = ", ".join(f"{name} {versions.get(name)} (here {present.get(name)})" for name in differ)
        raise SchedulerError(
            f"{address}: {worker_name} computes with {unlike}; give every worker the versions that are here and "
            "run this again: finished results are kept"
        )


async def _identity(library: Any, address: str, security: Any) -> str:  # noqa: ANN401 - distributed declares no types
    """Return the type of server at an address. Raises SchedulerError if none answers: a client would wait forever."""
    try:
        options = security.get_connection_args("client")
        async with asyncio.timeout(_ANSWERS), library.rpc(address, timeout=_ANSWERS, connection_args=options) as server:
            return str((await server.identity())["type"])
    except Exception as error:  # any program may listen there, with any answer
        reason = " ".join(str(error).split()) or f"nothing within {_ANSWERS:.0f} s"
        raise SchedulerError(
            f"{address}: no Dask scheduler answers there ({reason}); start one, or give no address"
        ) from error


KILLED = 0.1  # longest time for killed processes and their pool to end [s]


class Shelf:
    """Results by content: the same recording, options and versions give the same key."""

    def __init__(self, folder: Path, options: VisitOptions) -> None:
        """Keep results in `folder`, which is created with the first."""
        self._folder = folder
        recipe = {"form": FORM, "options": asdict(options), "versions": software_versions()}
        self._recipe = json.dumps(recipe, sort_keys=True, default=str).encode()

    def key(self, session: Path) -> str:
        """Return the SHA-256 over everything that a session's result depends on. Raises RecordingError."""
        digest = hashlib.sha256(self._recipe)
        digest.update(session.name.encode())
        for name, content in content_of(session).items():
            digest.update(f"\0{name}\0{len(content)}\0".encode() + content)
        return digest.hexdigest()

    def load(self, key: str) -> Visit | None:
        """Return the visit stored under a key; None if there is none, or if the file has changed."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            entry = json_object(self.file(key).read_bytes())
            if entry["sha256"] == _digest(entry["visit"]):
                return as_type(entry["visit"], Visit)
        return None

    def file(self, key: str) -> Path:
        """Return the file of a result."""
        return self._folder / f"{key}.json"

    def keep(self, key: str, result: Mapping[str, Any]) -> None:
        """Store a result. Raises RecordingError if it cannot be written."""
        text = json.dumps({"sha256": _digest(result), "visit": result}, ensure_ascii=False, allow_nan=False)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_whole(self.file(key), text.encode() + b"\n")
        except OSError as error:
            refusal = f"{self._folder} cannot be written ({error.strerror}): {remedy(error, new=True)}"
            raise RecordingError(
                f"{refusal}, or give another by --out, and run this again: finished results are kept"
            ) from error


def _digest(result: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()


def visits(
    folders: Sequence[Path],
    options: VisitOptions,
    shelf: Shelf,
    console: Console,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
) -> tuple[list[Visit], list[tuple[str, str]]]:
    """Return the result of each session, and the name and reason for each without one.

    Results on the shelf are not computed again. Raises SchedulerError, and RecordingError if the shelf is not writable.
    """
    keys, failures = _keys(folders, shelf)
    console.note(*(f"{name}: {reason}" for name, reason in failures))
    by_folder = {folder: shelf.load(key) for folder, key in keys.items()}
    results = [visit for visit in by_folder.values() if visit is not None]
    remaining = [folder for folder, visit in by_folder.items() if visit is None]
    for folder in remaining:
        if shelf.file(keys[folder]).exists():
            console.note(f"{folder.name}: {shelf.file(keys[folder])} is damaged; the session is computed again")
    if results:
        console.note(f"{len(results)} of {len(folders)} sessions were computed before and are reused")
    key_of = {folder.name: keys[folder] for folder in remaining}
    start = time.monotonic()
    if remaining:
        console.progress(0.0, f"0 of {len(remaining)} sessions")
    jobs = {folder.name: (folder, options) for folder in remaining}
    address = scheduler if remaining else None  # no scheduler is needed if everything is computed
    answers = (
        by_processes(compute_visit, jobs, workers)
        if address is None
        else by_cluster(compute_sent_visit, jobs, address, _contents)
    )
    try:
        for count, (name, answer) in enumerate(answers, 1):
            if isinstance(answer, str):
                failures.append((name, str(answer)))
                # Paths are relative to the current folder.
                console.note(f"{name}: {answer}".replace(f"{name}/", f"{jobs[name][0]}/"))
            else:
                if address is not None:
                    refuse_unlike(answer["made_by"], address, "a worker")
                shelf.keep(key_of[name], answer)
                results.append(as_type(answer, Visit))
            remaining_s = (time.monotonic() - start) / count * (len(remaining) - count)
            time_text = "" if console.at_terminal else f", {remaining_s:.0f} s left"
            console.progress(0.95 * count / len(remaining), f"{count} of {len(remaining)} sessions{time_text}")
    except KeyboardInterrupt:
        console.note(
            f"{len(results)} of {len(folders)} sessions are computed and kept; the next run continues from there"
        )
        raise
    return results, failures


def _keys(folders: Sequence[Path], shelf: Shelf) -> tuple[dict[Path, str], list[tuple[str, str]]]:
    """Return the key of each session, and the name and reason for each that cannot be read."""
    keys: dict[Path, str] = {}
    failures: list[tuple[str, str]] = []
    for folder in folders:
        try:
            keys[folder] = shelf.key(folder)
        except RecordingError as error:
            failures.append((folder.name, str(error)))
    return keys, failures


def by_processes(work: Callable[..., A], jobs: Jobs, workers: int | None) -> Generator[tuple[str, A | Lost]]:
    """Yield each job's name and the result of `work`, from `workers` processes here, or as many as cores."""
    remaining = dict(jobs)
    try:
        for name, answer in _in_pool(work, dict(remaining), workers) if remaining else ():
            del remaining[name]
            yield name, answer
    except BrokenProcessPool:  # a worker died over an unknown job: each job gets its own worker
        for name, arguments in remaining.items():
            try:
                yield from _in_pool(work, {name: arguments}, 1)
            except BrokenProcessPool:
                yield name, Lost("the process that computed it died, perhaps from lack of memory")


def _in_pool(work: Callable[..., A], jobs: Jobs, workers: int | None) -> Generator[tuple[str, A]]:
    """Yield names and answers. On an exception, such as Ctrl-C, the processes are killed."""
    pool = process_pool(workers or min(os.cpu_count() or 1, max(len(jobs), 1)))
    try:
        futures = {pool.submit(work, *arguments): name for name, arguments in jobs.items()}
        while futures:
            for future in wait(futures, _LOOK, FIRST_COMPLETED).done:
                yield futures.pop(future), future.result()
        pool.shutdown()
    except BaseException:
        for process in multiprocessing.active_children():
            process.kill()  # they hold only work that can be computed again
        thread = threading.Thread(target=pool.shutdown, kwargs={"cancel_futures": True}, daemon=True)
        thread.start()
        thread.join(KILLED)
        raise
