"""The page of the window's looks: its contrasts are those of the standard, and every one can be read."""

from pathlib import Path
from runpy import run_path
from types import SimpleNamespace

import pytest
from PySide6.QtGui import QImage

pytestmark = pytest.mark.qt


@pytest.fixture(scope="module")
def looks():
    return SimpleNamespace(**run_path(str(Path(__file__).parents[3] / "docs" / "looks.py")))


def test_contrast_is_that_of_the_standard(looks):
    assert looks.contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)  # WebAIM's published example
    assert looks.contrast("#ffffff", "#000000") == pytest.approx(21.0)


def test_all_that_is_written_and_a_selected_row_stand_out_in_both_themes(looks):
    assert {("on_act", "act"), ("surface", "wrong")} <= set(looks.PAIRS)
    for theme in looks.THEMES.values():
        for ground in (theme.ground, theme.surface, theme.raised):
            assert looks.contrast(theme.text, ground) >= 7.0
            assert looks.contrast(theme.act, ground) >= 4.5
        for ink, ground in looks.PAIRS:
            assert looks.contrast(getattr(theme, ink), getattr(theme, ground)) >= 4.5, (ink, ground)


@pytest.mark.usefixtures("application")
def test_the_page_has_a_picture_of_each_theme(looks, tmp_path):
    looks.write_pictures(tmp_path)
    for name, theme in looks.THEMES.items():
        picture = QImage(str(tmp_path / f"looks-{name}.png"))
        assert picture.pixelColor(2, 2).name() == theme.ground
        assert f"looks-{name}.png" in looks.page()
