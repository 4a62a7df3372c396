"""The machine of a measurement: hardware, load, versions."""

import os
import platform
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from solver.verification.request import Request


@dataclass(frozen=True, slots=True)
class Machine:
    """One machine at one moment. Times on a busy machine include those of other work."""

    system: str
    processor: str
    cores: int
    threads: str  # threads of linear algebra, from the environment variable
    load: float | None  # running processes, mean of the last minute; None where the system does not report it
    versions: dict[str, str]


def measure(request: Request) -> Iterator[Machine]:
    """Yield one row."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    threads = os.environ.get("OPENBLAS_NUM_THREADS", "not limited")
    yield Machine(
        f"{platform.system()} {platform.release()}", _processor(), os.cpu_count() or 1, threads, load,
        dict(request.host.versions),
    )  # fmt: skip


def _processor() -> str:
    """Return the processor's model name where the system reports it, else its type."""
    info = Path("/proc/cpuinfo")
    text = info.read_text(encoding="utf-8", errors="replace") if info.exists() else ""
    model = re.search("^model name.*?:(.*)", text, re.MULTILINE)
    return model[1].strip() if model else platform.processor() or platform.machine()
