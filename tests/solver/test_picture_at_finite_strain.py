"""The picture of a finger at finite strain has an SED at every node, also in the sharp corner where bone ends."""

import numpy as np
import pytest

from solver import Friction, Loading, Scene, Solve, solve
from solver.response.fields import fields_of

# Friction of two of the paper's surfaces; the first turns the corner node's own element inside out.
SURFACES = {"stickiness 0": (0.28, 0.008033, 2.0, "+x"), "slipperiness 100": (0.24, 0.00877, 1.5, "-x")}


@pytest.mark.parametrize("surface", SURFACES)
def test_every_node_that_is_drawn_has_an_sed_above_or_at_nought(surface):
    mu, tau_max, depth, slide = SURFACES[surface]
    scene = Scene(
        friction=Friction(mu=mu, tau_max=tau_max),
        loading=Loading(indentation=depth, slide=slide),
        solve=Solve(kinematics="finite"),
    )
    sed = fields_of(solve(scene)).sed
    assert np.isfinite(sed).all()
    assert (sed >= 0.0).all()
