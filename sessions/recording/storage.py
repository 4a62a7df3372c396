"""Storage of a session: the disk space it needs, a reserve for its end, and whether the folder is safe.

The write-ahead log of the live file and its locks work on a local disk only (SQLite documentation, "Write-Ahead
Logging", disadvantage 1). A program that synchronises removes files, or restores older ones, while they are written.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path, PurePath
from typing import NamedTuple

from sessions.file_access import open_new
from sessions.plan.plan import SessionPlan
from sessions.recording.schema import BYTES_A_READING, RecordingError

RATE_UNKNOWN = 1000.0  # readings a second assumed of a device that does not report them [Hz]
TRIAL_TIME = 90.0  # mounting, zero, stroke and score, with a redo now and then [s]
BLOCK_TIME = 300.0  # instruction, questions, a rest [s]
COPIES = 2  # the live file and its sealed copy
DISK_MARGIN = 64 * 2**20  # write-ahead log, events, reports [bytes]
RESERVE_FILE = "session.reserve"
RESERVE = 16 * 2**20  # enough for the last seconds of readings, the end, and folding the log [bytes]


def check_room(folder: Path, plan: SessionPlan, rate: float | None) -> None:
    """Raise RecordingError where the disk of `folder` has less free space than a session may need.

    `rate` of readings [Hz] is nan where unknown, None without a transducer.
    """
    duration = len(plan.trials) * TRIAL_TIME + len(plan.blocks) * BLOCK_TIME
    rows_a_second = 0.0 if rate is None else rate if isfinite(rate) else RATE_UNKNOWN
    size = round(COPIES * duration * rows_a_second * BYTES_A_READING) + DISK_MARGIN
    existing = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    free = shutil.disk_usage(existing).free
    if free < size:
        raise RecordingError(
            f"{folder} has {free / 1e6:.0f} MB of room, and the session may need {duration / 60:.0f} min at "
            f"{rows_a_second:g} readings a second of {BYTES_A_READING} bytes, kept twice, and {DISK_MARGIN / 1e6:.0f} "
            f"MB beside: {size / 1e6:.0f} MB; free space on the disk, or record on another"
        )


def take_reserve(folder: Path, size: int) -> None:
    """Reserve disk space, released on a full disk to write the end. Raises OSError where disk or quota lack it."""
    with open_new(folder / RESERVE_FILE) as file:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, size)
        else:
            file.write(bytes(size))
        os.fsync(file.fileno())


def release_reserve(folder: Path) -> None:
    """Release the reserve in `folder`, also that of a killed process. Harmless when repeated."""
    with suppress(OSError):
        (folder / RESERVE_FILE).unlink(missing_ok=True)


# File systems stored on another computer, on the host of a virtual machine, or in a cloud, by their names in Linux
# (/proc/mounts) and macOS (mount).
REMOTE = re.compile(
    r"nfs[34]?|cifs|smb[23]|smbfs|afpfs|webdav|davfs2?|ncpfs|afs|coda|ceph|glusterfs|lustre|gpfs|beegfs|orangefs|pvfs2"
    r"|fuse\.(sshfs|rclone|davfs2?|glusterfs|ceph|s3fs|gcsfuse|goofys|curlftpfs|smbnetfs|mfs|juicefs)|(osx|mac)fuse_sshfs"
    r"|vboxsf|vmhgfs|fuse\.vmhgfs-fuse|prl_fs|drvfs"
    r"|fuse\.(google-drive-ocamlfuse|onedriver|dropbox|pcloud|insync|mega|keybase|expandrive)"
)
# Names of the folders in which synchronising programs keep their files.
SYNC_FOLDERS: tuple[tuple[str, str], ...] = (
    (r"dropbox( \(.*\))?", "Dropbox"),
    (r"onedrive( - .*)?", "OneDrive"),
    (r"google ?drive|googledrive-.*", "Google Drive"),
    (r"icloud ?drive|mobile documents|com~apple~clouddocs", "iCloud"),
    (r"cloudstorage", "a cloud provider of macOS"),
    (r"nextcloud\d*", "Nextcloud"),
    (r"owncloud", "ownCloud"),
    (r"box sync|box-box", "Box"),
    (r"pcloud ?(drive|sync)", "pCloud"),
    (r"seafile", "Seafile"),
    (r"synologydrive", "Synology Drive"),
    (r"mega(sync)?( downloads)?", "MEGA"),
    (r"sciebo|switchdrive|polybox|surfdrive", "ownCloud"),
)
# Marker files of such programs in the topmost folder that they synchronise.
SYNC_MARKS: tuple[tuple[str, str], ...] = (
    (".dropbox", "Dropbox"),
    (".dropbox.cache", "Dropbox"),
    (".stfolder", "Syncthing"),
    (".sync", "Resilio Sync"),
    (".owncloudsync.log", "ownCloud"),
    (".nextcloudsync.log", "Nextcloud"),
    (".SynologyWorkingDirectory", "Synology Drive"),
    (".tmp.driveupload", "Google Drive"),
)
SYNC_DATABASE = re.compile(r"\._?sync_[0-9a-f]+\.db")  # of ownCloud and Nextcloud
SYNC_VARIABLES = ("OneDrive", "OneDriveCommercial", "OneDriveConsumer")  # set by Windows to OneDrive's folders
MOVE = "record into a folder on a disk of this computer, and copy it when it is sealed"


class Mount(NamedTuple):
    """A file system and where it is mounted."""

    kind: str
    path: PurePath
    source: str


def unsafe(folder: Path) -> str | None:
    """Return why a session must not be recorded in `folder`, which need not exist yet; None where it may."""
    location = folder.resolve()
    if (network := _on_a_network(location)) is not None:
        return network
    roots = [root for variable in SYNC_VARIABLES if (root := os.environ.get(variable))]
    onedrive = any(location.is_relative_to(root) for root in roots)
    program = sync_folder_above(location) or _program_by_mark(location) or ("OneDrive" if onedrive else None)
    return None if program is None else f"{location} is kept in step with a cloud by {program}; {MOVE}"


def file_system(folder: Path) -> str | None:
    """Return the kind of file system of `folder`, such as ext4; None where the system does not say."""
    mount = None if sys.platform == "win32" else innermost(folder.resolve(), _mounts())
    return None if mount is None else mount.kind


def innermost(path: PurePath, mounts: Iterable[Mount]) -> Mount | None:
    """Return the mount that holds `path`."""
    containing = [mount for mount in mounts if path.is_relative_to(mount.path)]
    # Of several mounts at one path the last hides the others, and `max` returns the first of equals.
    return max(reversed(containing), key=lambda mount: len(mount.path.parts), default=None)


def network_mount(path: PurePath, mounts: Iterable[Mount]) -> Mount | None:
    """Return the mount that holds `path` if it is on another computer, else None."""
    mount = innermost(path, mounts)
    if mount is None or REMOTE.fullmatch(mount.kind):
        return mount
    windows_drive = mount.kind == "9p" and re.match(r"([A-Z]:|drvfs)", mount.source)  # seen from WSL
    return mount if windows_drive else None


def sync_folder_above(path: PurePath) -> str | None:
    """Return the program that synchronises `path`, by the names of the path's folders; None without one."""
    folders = ((name, pattern, program) for name in path.parts for pattern, program in SYNC_FOLDERS)
    return next((program for name, pattern, program in folders if re.fullmatch(pattern, name, re.IGNORECASE)), None)


def linux_mounts(table: str) -> tuple[Mount, ...]:
    """Return the mounts of /proc/self/mounts; blanks in names are octal escapes there."""
    mounts: list[Mount] = []
    for line in table.splitlines():
        fields = (re.sub(r"\\([0-7]{3})", lambda octal: chr(int(octal[1], 8)), text) for text in line.split()[:3])
        source, path, kind = fields
        mounts.append(Mount(kind, PurePath(path), source))
    return tuple(mounts)


def mac_mounts(table: str) -> tuple[Mount, ...]:
    """Return the mounts that the command mount lists on macOS: `SOURCE on PLACE (KIND, ...)`."""
    lines = re.findall(r"^(.*) on (/.*) \(([^,)]+)", table, re.MULTILINE)
    return tuple(Mount(kind, PurePath(path), source) for source, path, kind in lines)


def _on_a_network(folder: Path) -> str | None:
    if sys.platform == "win32":
        import ctypes

        names_computer = folder.drive.startswith("\\\\")
        remote = names_computer or ctypes.windll.kernel32.GetDriveTypeW(f"{folder.drive}\\") == 4  # DRIVE_REMOTE
        return f"{folder} lies on a network drive; {MOVE}" if remote else None
    mount = network_mount(folder, _mounts())
    return None if mount is None else f"{folder} lies on another computer or is shared with one ({mount.kind}); {MOVE}"


def _mounts() -> Sequence[Mount]:
    table = Path("/proc/self/mounts")
    if table.exists():
        return linux_mounts(table.read_text(errors="surrogateescape"))
    try:
        output = subprocess.run(["/sbin/mount"], capture_output=True, text=True, timeout=5, check=False).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ()
    return mac_mounts(output)


def _program_by_mark(location: Path) -> str | None:
    """Return the synchronising program whose marker file lies in `location` or above it; None where there is none."""
    for folder in (location, *location.parents)[:-1]:  # nobody synchronises the root
        try:
            names = {entry.name for entry in folder.iterdir()}
        except OSError:
            continue
        for mark, program in SYNC_MARKS:
            if mark in names and (mark != ".dropbox" or folder != Path.home()):  # at home it holds Dropbox's settings
                return program
        if any(SYNC_DATABASE.fullmatch(name) for name in names):
            return "ownCloud or Nextcloud"
    return None
