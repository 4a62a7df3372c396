"""The subject's window on two screens of different density: a desk's, and a tablet's with two pixels for one."""

import json
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.qt

SCREENS = [
    {"name": "desk", "x": 0, "y": 0, "width": 1920, "height": 1080, "dpr": 1},
    {"name": "tablet", "x": 1920, "y": 0, "width": 1280, "height": 800, "dpr": 2},
]
USUAL = {"logicalDpi": 96, "logicalBaseDpi": 96}

CHILD = """
import json, sys
from PySide6.QtCore import QPoint, QSettings
from PySide6.QtWidgets import QApplication
QSettings.setDefaultFormat(QSettings.Format.IniFormat)
QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, sys.argv[1])
application = QApplication([])
from daq_app.qt import preferences
from daq_app.qt.subject_window import SubjectWindow
desk, tablet = application.screens()
preferences.store_ruler_length(desk, 80.0)     # a line meant to be 100 mm long measured 80 there
preferences.store_ruler_length(tablet, 125.0)  # and 125 here
subject = SubjectWindow(lambda: 0.0)
subject.show()
lengths = []
for screen in (desk, tablet, desk):
    subject.move(screen.geometry().topLeft() + QPoint(40, 40))
    application.processEvents()
    length = (subject.line.point_at(100.0) - subject.line.point_at(0.0)).x()
    lengths.append([subject.screen().name(), length * screen.devicePixelRatio(), screen.devicePixelRatio()])
print(json.dumps({"lengths": lengths, "dots": [s.physicalDotsPerInch() for s in (desk, tablet)]}))
"""


def test_the_line_is_100_mm_by_each_screens_own_ruler_when_the_window_moves_between_densities(tmp_path):
    config = tmp_path / "screens.json"
    config.write_text(json.dumps({"screens": [{**screen, **USUAL} for screen in SCREENS]}))
    environment = {**os.environ, "QT_QPA_PLATFORM": f"offscreen:configfile={config}"}
    command = [sys.executable, "-c", CHILD, str(tmp_path)]
    child = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=True)
    document = json.loads(child.stdout)
    assert [(name, density) for name, _, density in document["lengths"]] == [("desk", 1), ("tablet", 2), ("desk", 1)]
    # The screens say 100 dots an inch in units of which the tablet has two pixels each.
    on_desk, on_tablet = (dots / 25.4 * 100.0 for dots in document["dots"])
    lengths = [length for _, length, _ in document["lengths"]]
    assert lengths == pytest.approx([on_desk * 100 / 80, 2 * on_tablet * 100 / 125, on_desk * 100 / 80], abs=1e-6)
