"""Many sessions computed at once, on this computer's cores or a Dask cluster, each kept as soon as it is done."""

import hashlib
import json
import multiprocessing
import os
import time
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from daq_app.batch.cluster import Answer, by_cluster, computed, content_of
from daq_app.child_process import process_pool
from daq_app.console import Console
from sessions.file_access import converted, write_whole
from sessions.recording import RecordingError
from sessions.recording.head import software_versions
from sessions.statistics.pooling.visit import FORM, Visit, VisitOptions

LOOK = 0.1  # between two looks whether something is done [s]
KILLED = 0.1  # that a killed process may take to end [s]


class Shelf:
    """Results by the content they were made of: the same recording, options and versions give the same key."""

    def __init__(self, folder: Path, options: VisitOptions) -> None:
        """Keep results in `folder`, which is made when the first comes."""
        self._folder = folder
        recipe = {"form": FORM, "options": asdict(options), "versions": software_versions()}
        self._recipe = json.dumps(recipe, sort_keys=True, default=str).encode()

    def key(self, session: Path) -> str:
        """Return the SHA-256 over all that a session's result comes from. Raises OSError."""
        digest = hashlib.sha256(self._recipe)
        digest.update(session.name.encode())
        for name, content in content_of(session).items():
            digest.update(f"\0{name}\0{len(content)}\0".encode() + content)
        return digest.hexdigest()

    def stored(self, key: str) -> Visit | None:
        """Return what was kept under a key; None where nothing was, or it is not what was written."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            kept = json.loads(self.file(key).read_bytes())
            if kept["sha256"] == _digest(kept["visit"]):
                return converted(kept["visit"], Visit)
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
    kept = {folder: shelf.stored(key) for folder, key in keys.items()}
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
    answers = _local(missing, options, workers) if here else by_cluster(missing, options, scheduler or "")
    try:
        for count, (name, answer) in enumerate(answers, 1):
            if isinstance(answer, str):
                failed.append((name, answer))
                console.note(f"{name}: {answer}")
            else:
                shelf.keep(named[name], answer)
                done.append(converted(answer, Visit))
            left = (time.monotonic() - begun) / count * (len(missing) - count)
            remaining = "" if console.at_terminal else f", {left:.0f} s left"
            console.progress(0.95 * count / len(missing), f"{count} of {len(missing)} sessions{remaining}")
    except KeyboardInterrupt:
        console.note(f"{len(done)} of {len(folders)} sessions are computed and kept; the next run goes on from there")
        raise
    return done, failed


def _local(folders: Sequence[Path], options: VisitOptions, workers: int | None) -> Iterator[Answer]:
    """Yield answers as they come, from processes of this computer."""
    if not folders:
        return
    left = {folder.name: folder for folder in folders}
    try:
        for answer in _in_pool(list(left.values()), options, workers):
            del left[answer[0]]
            yield answer
    except BrokenProcessPool:  # a worker died, and nobody knows over which session: each gets a worker of its own
        for folder in list(left.values()):
            try:
                yield from _in_pool([folder], options, 1)
            except BrokenProcessPool:
                yield folder.name, "the process that computed it died, perhaps for want of memory"


def _in_pool(folders: Sequence[Path], options: VisitOptions, workers: int | None) -> Iterator[Answer]:
    with local_pool(len(folders), workers) as pool:
        waiting: set[Future[Answer]] = {pool.submit(computed, folder, options) for folder in folders}
        while waiting:
            ready, waiting = wait(waiting, LOOK, FIRST_COMPLETED)
            for future in ready:
                yield future.result()


@contextmanager
def local_pool(work: int, workers: int | None = None) -> Generator[ProcessPoolExecutor]:
    """Give a pool for so many pieces of work: `workers` processes, or as many as there are cores.

    At the end the work is waited for. Where an exception leaves, as on Ctrl-C, the processes are killed.
    """
    pool = process_pool(workers or min(os.cpu_count() or 1, work))
    try:
        yield pool
        pool.shutdown()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        children = multiprocessing.active_children()
        for process in children:
            process.kill()  # they hold nothing that is not computed again
        for process in children:
            process.join(KILLED)
        raise
