"""What the finger's picture shows, and what is read from it: places, fields at them and along lines."""

import numpy as np
import pytest

from daq_app.analyst.frame import (
    FIELD_CHOICES,
    Frame,
    FrameMesh,
    View,
    along_line,
    along_skin,
    automatic_range,
    probe_text,
    value_at,
)
from solver.prediction import Skin, SkinLine

NONE = np.empty(0)
BY_NAME = {field.name: field for field in FIELD_CHOICES}
BOX = (-2.0, 8.0, -1.0, 4.0)

# A square of four triangles about its middle; a field that is linear in x and y is then the same inside each.
NODES = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [2.0, 2.0]])
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
PLANE = 0.001 * (2.0 * NODES[:, 0] - NODES[:, 1])  # [MPa]
SIDE = SkinLine(np.array([-1.0, 1.0]), np.array([[0] * 9, [1] * 9]), np.full((2, 9), 1.0 / 9.0))
PARTS = FrameMesh(TRIANGLES, np.empty((0, 8), np.int64), np.array([0, 1, 2, 2]), SIDE)


def frame(mesh=PARTS, **values):
    return Frame(mesh, NODES, {"sed": PLANE, **values}, {}, NODES, Skin(NONE, NONE, NONE, NONE, ()), NONE)


def test_all_of_a_box_is_shown_at_the_foot_of_the_picture_and_a_pixel_leads_back_to_its_place():
    view = View.fit(BOX, 10.0, 20.0, 100.0, 200.0)
    assert view.per_mm == 10.0
    assert view.visible(10.0, 20.0, 100.0, 200.0) == pytest.approx((-2.0, 8.0, -1.0, 19.0))
    points = np.array([[0.0, 0.0], [3.0, 2.5]])
    places = [view.from_screen(*pixel) for pixel in view.to_screen(points).tolist()]
    np.testing.assert_allclose(places, points, atol=1e-12)


def test_a_linear_field_is_read_exactly_at_every_place_and_along_every_line():
    field = BY_NAME["sed"]
    points = np.random.default_rng(3).uniform(0.0, 4.0, (20, 2))
    values, _ = value_at(frame(), field, points)
    np.testing.assert_allclose(values, 2.0 * points[:, 0] - points[:, 1], atol=1e-9)
    away, values = along_line(frame(), field, ((1.0, 1.0), (4.0, 5.0)))
    inside = away <= 3.75  # of its 5 mm: there it leaves the square, at y = 4
    np.testing.assert_allclose(values[inside], 1.0 + (2.0 * 0.6 - 0.8) * away[inside], atol=1e-9)
    assert np.isnan(values[~inside]).all()


def test_the_probe_names_field_unit_place_and_tissue():
    words = probe_text(frame(), BY_NAME["sed"], 3.5, 2.0)
    assert words == "SED 5 kPa · x 3.500 mm, y 2.000 mm · dermis"
    assert probe_text(frame(), BY_NAME["sed"], -1.0, 2.0) == "x −1.000 mm, y 2.000 mm · no tissue"


def test_a_finger_without_triangles_has_no_field_anywhere():
    bare = FrameMesh(np.empty((0, 3), np.int64), np.empty((0, 8), np.int64), np.empty(0, np.int64))
    assert probe_text(frame(bare), BY_NAME["sed"], 1.0, 1.0).endswith("no tissue")
    assert np.isnan(along_line(frame(bare), BY_NAME["sed"], ((0.0, 0.0), (1.0, 1.0)))[1]).all()
    assert along_skin(frame(bare), BY_NAME["sed"])[0].size == 0


def test_a_strain_has_no_unit_and_a_negative_number_a_minus():
    strained_frame = frame(principal_strain_least=np.full(5, -0.125))
    words = probe_text(strained_frame, BY_NAME["principal_strain_least"], 2.0, 0.5)
    assert words == "least principal strain −0.125 · x 2.000 mm, y 0.500 mm · epidermis"


def test_the_field_along_the_skin_is_that_of_the_skin_s_own_nodes():
    place, values = along_skin(frame(), BY_NAME["sed"])
    assert place.tolist() == [-1.0, 1.0]
    np.testing.assert_allclose(values, 1000.0 * PLANE[:2], atol=1e-12)


def test_colours_of_a_signed_field_have_nought_in_their_middle_and_others_begin_there():
    field_frame = frame(pressure=np.array([-0.02, 0.0, 0.0, 0.0, 0.01]), von_mises=np.full(5, 0.009))
    low, high = automatic_range(BY_NAME["pressure"], [field_frame])
    assert low == -high < 0.0
    assert automatic_range(BY_NAME["von_mises"], [field_frame]) == (0.0, 10.0)
    assert automatic_range(BY_NAME["displacement"], [field_frame]) == (0.0, 1.0)  # the frame has none
