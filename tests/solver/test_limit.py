"""Where settled sliding ends at finite strain."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Finger, Friction, Loading, Material, Materials, NoSteadyState, NotConverged, Scene, Solve
from solver.body.finite import FiniteBody
from solver.constitutive import NeoHooke, Ogden
from solver.contact import LoadState
from solver.continuation import BRANCH, Continuation, critical_stretch, existence, finite_states
from solver.equilibrium import BY_FRICTION, Newton
from solver.equilibrium.finger import FiniteFinger, finite_laws
from solver.equilibrium.load_stepping import solve_full_slip
from solver.mesh import grid_mesh, mesher
from tests.solver.finite_examples import published

SLOW = pytest.mark.slow
TOWARDS_TIP = -1  # the bone goes along +x, so the surface pulls the skin along -x
SQUEEZED = [(1.8, 69.4, (0.1525, 0.0775, 0.0303)), (1.73, 65.9, (0.1198, 0.0576, 0.0306))]  # drawn at random


def squeezed_scene(depth, angle, tissues):
    """Return a scene whose branch ends because the skin is squeezed at one place, far from a limit point."""
    return Scene(
        finger=Finger(contact_angle=angle),
        materials=Materials(*(Material(modulus, 0.48) for modulus in tissues)),
        friction=Friction(0.85),
        loading=Loading(depth, "+x"),
        solve=Solve("finite"),
    )


@pytest.mark.parametrize(
    ("depth", "largest"),
    [pytest.param(1.0, 0.987, marks=SLOW), (1.5, 0.609), (2.0, 0.373), pytest.param(2.5, 0.233, marks=SLOW)],
)
def test_friction_has_the_limit_that_several_meshes_and_orders_of_another_code_found(depth, largest):
    reach = existence.friction_limit(
        Scene(friction=Friction(0.0), loading=Loading(depth)), LoadState(depth, 0.0, np.inf, TOWARDS_TIP), 2.0
    )
    assert reach.ends_early
    assert reach.value == pytest.approx(largest, rel=0.03)


@pytest.mark.parametrize(
    ("mu", "tau", "largest"),
    [
        (0.44, 0.015478, 1.85),
        pytest.param(0.48, 0.019038, 1.75, marks=SLOW),
        pytest.param(0.64, 0.049998, 1.45, marks=SLOW),
        (0.67, 0.05255, 1.43),
    ],
)
def test_depth_has_the_limit_that_another_code_found(mu, tau, largest):
    scene = Scene(friction=Friction(mu), loading=Loading(2.0))
    reach = existence.depth_limit(scene, LoadState(2.0, mu, tau, TOWARDS_TIP))
    assert reach.ends_early
    assert reach.value == pytest.approx(largest, rel=0.03)


@SLOW
@pytest.mark.parametrize(("depth", "angle", "tissues"), SQUEEZED)
def test_where_skin_folds_at_one_place_both_limits_are_those_of_a_mesh_of_half_the_size(
    depth, angle, tissues, monkeypatch
):
    scene = squeezed_scene(depth, angle, tissues)
    load = LoadState(depth, 0.85, np.inf, TOWARDS_TIP)
    mu, deepest = existence.friction_limit(scene, load, 2.0), existence.depth_limit(scene, load)
    monkeypatch.setattr(existence, "FINENESS", 2.0 * existence.FINENESS)
    monkeypatch.setattr(mesher, "FOLD", tuple(size / 2.0 for size in mesher.FOLD))
    finer = squeezed_scene(depth + 1e-9, angle, tissues)  # what was answered is not asked again
    load = load._replace(depth=depth + 1e-9)
    assert mu.value == pytest.approx(existence.friction_limit(finer, load, 2.0).value, rel=0.015)
    assert deepest.value == pytest.approx(existence.depth_limit(finer, load).value, rel=0.01)


def test_a_branch_that_reaches_what_was_asked_for_is_the_direct_answer():
    finger = published(5)
    load = LoadState(1.0, 0.5, 0.03, TOWARDS_TIP)
    start = solve_full_slip(finger.newton, load._replace(mu=0.0))
    branch = Continuation(finger, BY_FRICTION, 0.54).branch(start, load.mu)
    second_branch = Continuation(finger, BY_FRICTION, 0.54).branch(branch.last, load.mu)  # nothing is left to follow
    assert second_branch.states == (branch.last,)
    assert not second_branch.ends_early
    assert not branch.ends_early
    close = BRANCH.tolerance * finger.newton.length_scale
    np.testing.assert_allclose(branch.last.u, solve_full_slip(finger.newton, load).u, atol=close)


def test_every_friction_beyond_the_end_of_a_branch_has_the_same_limit():
    scene, load = Scene(friction=Friction(0.0), loading=Loading(2.2)), LoadState(2.2, 0.0, np.inf, TOWARDS_TIP)
    targets = (1.1, 0.33, 0.7)  # in pieces of the branch that are traced one after another
    assert len({existence.friction_limit(scene, load, target).value for target in targets}) == 1


@pytest.mark.parametrize("exponent", [None, 2.0])
def test_a_surface_that_keeps_its_volume_folds_where_biot_found(exponent):
    x = np.roots([1.0, 1.0, 3.0, -1.0])  # Biot 1963: x^3 + x^2 + 3 x - 1 = 0 for the square of the stretch
    biot = float(np.sqrt(x[np.isreal(x)].real[0]))
    law = NeoHooke(0.136, 0.4999999) if exponent is None else Ogden(0.136, 0.4999999, exponent)
    assert critical_stretch(law) == pytest.approx(biot, rel=1e-5)


def test_skin_that_stiffens_folds_later():
    folds = [critical_stretch(Ogden(0.136, 0.48, exponent)) for exponent in (2.0, 3.0, 6.0, 9.0)]
    assert folds == sorted(folds, reverse=True)


@SLOW
def test_a_finger_handed_in_as_arrays_is_refused_beyond_the_friction_that_another_code_found():
    scene = Scene(friction=Friction(0.0), loading=Loading(2.0))
    laws = finite_laws(scene.materials)
    mesh = FiniteFinger.of(scene, mesher.Sizing(11.0, 2.0, margin=6.0)).geometry.mesh
    newton = Newton(FiniteBody.of(mesh, laws).condensed)
    load = LoadState(2.0, 0.5, np.inf, TOWARDS_TIP)
    with pytest.raises(NoSteadyState) as refusal:
        finite_states.steady_body(newton.condensed.body, load, laws[mesher.EPIDERMIS])
    assert refusal.value.limit_mu == pytest.approx(0.373, rel=0.03)
    below = finite_states.steady_body(newton.condensed.body, load._replace(mu=0.3), laws[mesher.EPIDERMIS])
    np.testing.assert_allclose(below.u, solve_full_slip(newton, load._replace(mu=0.3)).u, atol=1e-6)


@SLOW
@pytest.mark.parametrize("layers", [8, 12])
def test_what_is_crushed_beside_a_rigid_core_is_reported_as_not_known_whatever_the_mesh(layers):
    # a half cylinder around a rigid core, pressed by a third of its thickness: in its corners det F falls below 0.3
    # on any mesh, on finer ones at less friction, so that no mesh tells a limit
    angle, part = np.linspace(-np.pi / 2, np.pi / 2, 10 * layers + 1), np.linspace(0.35, 1.0, 2 * layers + 1)
    x, y = np.sin(angle)[:, None] * part, 1.0 - np.cos(angle)[:, None] * part
    core = np.arange(len(angle)) * len(part)
    mesh = grid_mesh(5.0 * np.stack([x, y], axis=-1), np.zeros(layers, np.int64), slice(0, len(angle)), core)
    newton = Newton(FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)]).condensed)
    with pytest.raises(NotConverged, match="is not known"):
        finite_states.steady_body(newton.condensed.body, LoadState(1.0, 1.5, sense=TOWARDS_TIP), NeoHooke(0.08, 0.48))


def test_no_limit_of_friction_is_reported_where_growing_depth_arrives_beyond_it(monkeypatch):
    scene = Scene(friction=Friction(0.6), loading=Loading(2.0, "-x"), solve=Solve("finite"))
    load = LoadState(2.0, 0.6, np.inf, TOWARDS_TIP)
    search = existence.BranchSearch(scene, load, BY_FRICTION, load.mu)
    branch_end = existence.ContinuationLimit(
        search, 0.373, ends_early=True, corrector_failed=False, least_stretch=0.55, numbers=np.ones(3)
    )

    def by_depth(_scene, target):
        # with a little less friction 2 mm are reached
        return replace(branch_end, value=1.5, ends_early=target.mu == load.mu)

    monkeypatch.setattr(existence, "_direct_states", lambda *_: iter(()))
    monkeypatch.setattr(existence, "friction_limit", lambda *_: branch_end)
    monkeypatch.setattr(existence, "depth_limit", by_depth)
    with pytest.raises(NotConverged, match=r"followed up to mu = 0\.373 and lost there"):
        existence.slide_on_branch(FiniteFinger.of(scene, mesher.Sizing(5.0, 2.0)), load)
    monkeypatch.setattr(existence, "depth_limit", lambda *_: replace(branch_end, value=1.5))
    with pytest.raises(NoSteadyState) as refusal:
        existence.slide_on_branch(FiniteFinger.of(scene, mesher.Sizing(5.0, 2.0)), load)
    assert (refusal.value.limit_mu, refusal.value.limit_indentation) == (0.373, 1.5)
