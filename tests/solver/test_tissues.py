"""Laws named in a scene reach the elements, and those that a kinematics does not have are refused."""

from dataclasses import replace

import pytest

from sessions.toml_file import load_toml
from solver import Friction, Loading, Material, Materials, Relaxation, Scene, SceneError, Solve, solve
from solver.response.fields import fields_of
from solver.scene.published import SLIPPERINESS, scene

NAMES = ("epidermis", "dermis", "fat")


def with_skin(law, stiffening=None, kinematics="finite"):
    usual = Materials()
    skin = {name: replace(usual.of(name), law=law, stiffening=stiffening) for name in ("epidermis", "dermis")}
    return replace(scene(SLIPPERINESS[4]), materials=replace(usual, **skin), solve=Solve(kinematics, "steady", 0.5))


def test_with_an_exponent_of_two_ogdens_law_is_the_neo_hookean_one_and_with_that_of_skin_the_finger_resists_more():
    usual, linear, skin = (solve(with_skin(*law)) for law in [("neo-hookean",), ("ogden", 2.0), ("ogden",)])
    assert linear.sed_ending == pytest.approx(usual.sed_ending, rel=1e-6)
    assert linear.normal_force == pytest.approx(usual.normal_force, rel=1e-6)
    assert skin.normal_force > 1.02 * usual.normal_force
    assert "Ogden, exponent 9 (default: human skin" in skin.model["material"]


def test_the_default_laws_are_hooke_at_small_strain_and_neo_hooke_at_finite_strain():
    for kinematics, law in (("small", "hooke"), ("finite", "neo-hookean")):
        prediction = solve(with_skin(law, kinematics=kinematics))
        assert prediction.sed_ending == solve(with_skin(None, kinematics=kinematics)).sed_ending


def test_the_picture_at_finite_strain_shows_the_energy_of_its_law():
    prediction = solve(with_skin("ogden"))
    picture = fields_of(prediction)
    middle = (picture.patch[:-1].min(axis=0) + picture.patch[:-1].max(axis=0)) / 2.0
    nearest = ((picture.nodes - middle) ** 2).sum(axis=1).argmin()
    assert picture.sed[nearest] == pytest.approx(prediction.sed_ending, rel=0.15)


@pytest.mark.parametrize(
    ("tissue", "kinematics", "key"),
    [
        (Material(0.1, 0.48, "rubber"), "finite", "materials.dermis.law"),
        (Material(0.1, 0.48, "hooke"), "finite", "materials.dermis.law"),
        (Material(0.1, 0.48, "neo-hookean"), "small", "materials.dermis.law"),
        (Material(0.1, 0.48, "ogden", 1.5), "finite", "materials.dermis.stiffening"),
        (Material(0.1, 0.48, "neo-hookean", 1.0), "finite", "materials.dermis.stiffening"),
        (Material(0.1, 0.48, "ogden", 21.0), "finite", "materials.dermis.stiffening"),
        (Material(0.1, 0.48, prony=(Relaxation(0.3, 0.0),)), "small", "materials.dermis.prony[0].tau"),
        (Material(0.1, 0.48, prony=(Relaxation(0.6, 0.1), Relaxation(0.6, 1.0))), "small", "materials.dermis.prony"),
    ],
)
def test_laws_that_do_not_fit_are_refused_with_their_key(tissue, kinematics, key):
    with pytest.raises(SceneError) as refusal:
        Scene(
            materials=replace(Materials(), dermis=tissue),
            friction=Friction(0.3),
            loading=Loading(1.0),
            solve=Solve(kinematics),
        )
    assert refusal.value.key == key


def test_a_scene_file_may_hold_every_option(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(
        '[finger]\nbone = "meshed"\ncut = "driven"\nnail_length = 10\nwidth = 15.0\n'
        '[materials.dermis]\nE = 0.08\nnu = 0.48\nlaw = "hooke"\nprony = [{ g = 0.2, tau = 0.07 }]\n'
        '[friction]\nmu = 0.5\n[loading]\nnormal_force = 1.5\nforce_unit = "N"\nslide = ["+x", "-x"]\n'
        '[solve]\nevidence = "measured"\n'
    )
    loaded_scene = load_toml(path, Scene)
    assert loaded_scene.normal_force == pytest.approx(0.1)
    assert loaded_scene.loading.directions == (1, -1)
    assert loaded_scene.materials.dermis.prony == (Relaxation(0.2, 0.07),)
