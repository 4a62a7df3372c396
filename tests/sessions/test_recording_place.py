from pathlib import Path, PurePosixPath

import pytest

from sessions.recording import storage as place
from sessions.recording.storage import Mount, linux_mounts, mac_mounts, network_mount, sync_folder_above, unsafe

LINUX = """\
/dev/sda1 / ext4 rw,relatime 0 0
server:/export/lab /home/lab nfs4 rw 0 0
tmpfs /home/lab/scratch tmpfs rw 0 0
//nas/data /mnt/nas\\040data cifs rw 0 0
C:\\134 /mnt/c 9p rw,aname=drvfs 0 0
root /srv 9p rw 0 0
remote: /home/me/cloud fuse.rclone rw 0 0
"""
MAC = """\
/dev/disk3s1s1 on / (apfs, sealed, local, read-only, journaled)
//me@nas._smb._tcp.local/lab (1) on /Volumes/lab (1) (smbfs, nodev, nosuid, mounted by me)
/dev/disk5s1 on /Volumes/stick (msdos, local)
"""


@pytest.mark.parametrize(
    ("table", "folder", "kind"),
    [
        (LINUX, "/home/me/recordings/P07", None),
        (LINUX, "/home/lab/recordings/P07", "nfs4"),
        (LINUX, "/home/lab/scratch/P07", None),
        (LINUX, "/home/laboratory/P07", None),
        (LINUX, "/mnt/nas data/P07", "cifs"),
        (LINUX, "/mnt/c/Users/P07", "9p"),
        (LINUX, "/srv/P07", None),
        (LINUX, "/home/me/cloud/P07", "fuse.rclone"),
        (MAC, "/Users/me/P07", None),
        (MAC, "/Volumes/lab (1)/P07", "smbfs"),
        (MAC, "/Volumes/stick/P07", None),
    ],
)
def test_the_innermost_mount_decides_whether_a_folder_lies_on_another_computer(table, folder, kind):
    mounts = (mac_mounts if table is MAC else linux_mounts)(table)
    mount = network_mount(PurePosixPath(folder), mounts)
    assert (mount and mount.kind) == kind


def test_a_mount_over_another_hides_it():
    root = PurePosixPath("/data")
    mounts = [Mount("nfs", root, "a:/b"), Mount("ext4", root, "/dev/sdb1")]
    assert network_mount(root / "x", mounts) is None
    assert network_mount(root / "x", mounts[::-1]) is not None


@pytest.mark.parametrize(
    ("folder", "program"),
    [
        ("/home/me/Dropbox (Lab)/P07", "Dropbox"),
        ("/home/me/OneDrive - University of X/P07", "OneDrive"),
        ("/Users/me/Library/CloudStorage/Box-Box/P07", "a cloud provider of macOS"),
        ("/Users/me/Library/Mobile Documents/com~apple~CloudDocs/P07", "iCloud"),
        ("/home/me/Nextcloud2/P07", "Nextcloud"),
        ("/home/me/recordings/P07", None),
        ("/home/me/dropbox-experiment/P07", None),
        ("/home/megan/P07", None),
    ],
)
def test_folders_of_synchronising_programs_are_known_by_name(folder, program):
    assert sync_folder_above(PurePosixPath(folder)) == program


@pytest.mark.parametrize(
    ("mark", "program"), [(".stfolder", "Syncthing"), ("._sync_0a1b2c.db", "ownCloud or Nextcloud")]
)
def test_folders_of_synchronising_programs_are_known_by_what_they_leave_there(tmp_path, mark, program):
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / mark).touch()
    sentence = unsafe(tmp_path / "lab" / "recordings" / "P07")
    assert f"kept in step with a cloud by {program}" in sentence
    assert "record into a folder on a disk of this computer" in sentence
    assert unsafe(tmp_path / "other" / "P07") is None


def test_a_network_folder_is_refused_in_one_sentence(monkeypatch):
    monkeypatch.setattr(place, "_mounts", lambda: (Mount("nfs4", Path("/"), "server:/"),))
    sentence = unsafe(Path("/nowhere/P07"))
    assert sentence.startswith("/nowhere/P07 lies on another computer or is shared with one (nfs4); record into")
