"""The certificate of a self-test: written beside the sessions of a disk, and carried by each of them."""

import json
from pathlib import Path
from typing import Any

from sessions.atomic_file import write_whole
from sessions.file_access import read_limited
from sessions.json_document import json_object
from sessions.recording.provenance import software_versions

CERTIFICATE_FILE = "daq-app-selftest.json"
FORMAT = {"name": "daq-app selftest", "version": 1}


def write_certificate(folder: Path, certificate: dict[str, Any]) -> Path:
    """Write the certificate where sessions recorded below `folder` find it, and return its path."""
    path = folder / CERTIFICATE_FILE
    write_whole(path, json.dumps(certificate, indent=1, allow_nan=False).encode() + b"\n")
    return path


def certificate_for(folder: Path) -> dict[str, Any] | None:
    """Return the certificate in the nearest folder above `folder` on the same disk; None where there is none.

    `same_program` is added: whether this program and its libraries are those that were tested.
    """
    places = folder.absolute().parents
    disk = next((place.stat().st_dev for place in places if place.exists()), None)
    for place in places:
        path = place / CERTIFICATE_FILE
        try:
            certificate = json_object(read_limited(path))
            if certificate["format"] != FORMAT or path.stat().st_dev != disk:
                continue
            return {**certificate, "same_program": certificate["software"] == software_versions()}
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return None
