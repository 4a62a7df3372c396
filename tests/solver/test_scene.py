import math
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

from solver import Finger, Friction, Loading, Material, Materials, Receptor, Relaxation, Scene, SceneError, Solve
from solver.scene.published import SLIPPERINESS, STICKINESS, scene, scenes


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: Finger(tip_radius=-1.0), "finger.tip_radius"),
        (lambda: Finger(epidermis=math.nan), "finger.epidermis"),
        (lambda: Finger(contact_angle=95.0), "finger.contact_angle"),
        (lambda: Finger(bone_radius=2.9), "finger.bone_centre"),
        (lambda: Finger(bone_centre=(-1.0, 1.6)), "finger.bone_centre"),
        (lambda: Materials(fat=Material(0.034, 0.5)), "materials.fat.nu"),
        (lambda: Materials(dermis=Material(0.0, 0.48)), "materials.dermis.E"),
        (
            lambda: Scene(
                friction=Friction(0.3),
                loading=Loading(1.0),
                materials=Materials(bone=Material(200.0, 0.3, prony=(Relaxation(0.5, 1000.0),))),  # and it is rigid
            ),
            "materials.bone.prony",
        ),
        (lambda: Friction(-0.1), "friction.mu"),
        (lambda: Friction(True), "friction.mu"),
        (lambda: Friction(0.3, -1.0), "friction.tau_max"),
        (lambda: Friction(math.inf), "friction.mu"),
        (lambda: Loading(0.0), "loading.indentation"),
        (lambda: Loading(1e-9), "loading.indentation"),
        (lambda: Friction(1e-300), "friction.mu"),
        (lambda: Friction(0.3, 1e-300), "friction.tau_max"),
        (
            lambda: Scene(
                friction=Friction(0.3),
                loading=Loading(1.0),
                finger=Finger(shaft_length=5.0),
                receptor=Receptor(ending=(0.2, 20.0)),
            ),
            "receptor.ending",
        ),
        (
            lambda: Scene(
                friction=Friction(0.3), loading=Loading(1.0), materials=Materials(epidermis=Material(1e9, 0.3))
            ),
            "materials.epidermis.E",
        ),
        (lambda: Loading(2.0, "sideways"), "loading.slide"),
        (lambda: Loading(2.0, "+x", 0.0), "loading.speed"),
        (lambda: Receptor(ending=(0.2, 0.0)), "receptor.ending"),
        (lambda: Solve(kinematics="huge"), "solve.kinematics"),
        (lambda: Solve(course="backwards"), "solve.course"),
        (lambda: Solve(tolerance=0.0), "solve.tolerance"),
        (lambda: Scene(friction=Friction(0.3), loading=Loading(4.8)), "loading.indentation"),
        (lambda: Scene(friction=Friction(0.3), loading=Loading(2.0), receptor=Receptor(depth=2.5)), "receptor.depth"),
        (lambda: Finger(width=0.0), "finger.width"),
        (lambda: Finger(bone_centre=(-1.0, math.inf)), "finger.bone_centre"),
        (lambda: Receptor(ending=0.2), "receptor.ending"),
        (lambda: Friction("0.4"), "friction.mu"),
        (lambda: Scene(friction=0.4, loading=Loading(1.0)), "friction"),
        (lambda: Scene(friction=Friction(0.4), loading=Loading(1.0), solve="finite"), "solve"),
        (lambda: Materials(fat=(0.034, 0.48)), "materials.fat"),
        (lambda: Materials(fat=Material(None, 0.48)), "materials.fat.E"),
        (lambda: Materials(fat=Material(0.034, "0.48")), "materials.fat.nu"),
        (lambda: Materials(fat=Material(0.034, 0.48, prony=((0.2, 1.0),))), "materials.fat.prony"),
    ],
)
def test_what_cannot_be_run_is_refused_in_one_sentence_that_names_key_value_and_what_is_allowed(make, key):
    with pytest.raises(SceneError) as refusal:
        make()
    assert refusal.value.key == key
    message = str(refusal.value)
    assert message.startswith(f"{key} = ")
    assert message.endswith(".")
    assert "\n" not in message


def test_lists_and_numbers_of_numpy_make_the_scene_of_tuples_and_plain_numbers():
    numpy_scene = Scene(
        finger=Finger(np.float32(5.0), bone_centre=[-1.0, np.float64(0.75)], contact_angle=np.int8(45)),
        materials=Materials(fat=Material(np.array(0.034), 0.48, prony=[Relaxation(np.float16(0.5), 1.0)])),
        friction=Friction(np.array(0.44)),
        loading=Loading(np.uint8(1), ["+x", "-x"]),
        receptor=Receptor(ending=np.array([0.2, 1.0])),
    )
    plain_scene = Scene(
        materials=Materials(fat=Material(0.034, 0.48, prony=(Relaxation(0.5, 1.0),))),
        friction=Friction(0.44),
        loading=Loading(1, ("+x", "-x")),
    )
    assert repr(numpy_scene) == repr(replace(plain_scene, finger=Finger(contact_angle=45)))
    assert hash(numpy_scene) == hash(plain_scene)


def test_the_error_of_a_scene_says_the_same_when_it_comes_from_another_process():
    with pytest.raises(SceneError) as refusal:
        Friction(-0.1)
    copy = pickle.loads(pickle.dumps(refusal.value))
    assert (str(copy), copy.key, copy.value) == (str(refusal.value), "friction.mu", -0.1)


def test_the_defaults_are_the_published_finger():
    default = Scene(friction=Friction(0.67, 0.05255), loading=Loading(2.0, "+x", 15.0), title="stickiness 100")
    assert default == scene(STICKINESS[-1])
    assert [getattr(default.materials, f.name).E for f in fields(Materials)] == [0.136, 0.08, 0.034, 200.0]


def test_the_ten_published_scenes_are_those_of_the_tables():
    ten = scenes()
    assert [s.title for s in ten[::4]] == ["stickiness 0", "stickiness 100", "slipperiness 75"]
    assert [s.loading.indentation for s in ten] == [2.0] * 5 + [1.5] * 5
    assert [s.loading.slide for s in ten] == ["+x"] * 5 + ["-x"] * 5
    # tau_max [kPa] of the tables, computed as force by 1 cm2
    kilopascals = [8.033, 15.478, 19.038, 49.998, 52.55, 47.07, 42.404, 30.09, 26.0, 8.77]
    assert [1e3 * s.friction.cap for s in ten] == pytest.approx(kilopascals)


def test_the_bound_as_printed_is_a_hundredth_of_the_computed_one_and_never_a_silent_default():
    for surface in STICKINESS + SLIPPERINESS:
        assert scene(surface, "as-printed").friction.cap == pytest.approx(0.01 * scene(surface).friction.cap)


def test_a_scene_can_be_changed_and_is_checked_again():
    sticky = scene(STICKINESS[0])
    with pytest.raises(SceneError, match="indentation"):
        replace(sticky, loading=replace(sticky.loading, indentation=-1.0))


@pytest.mark.parametrize(
    "finger",
    [
        Finger(),
        Finger(contact_angle=10.0),
        Finger(bone_centre=(-6.0, 0.75), contact_angle=10.0),
        Finger(bone_centre=(1.0, -0.4), contact_angle=90.0),
    ],
)
def test_no_scene_is_pressed_so_deep_that_the_surface_would_lie_in_the_bone(finger):
    angle, phi = np.radians(finger.contact_angle), np.radians(np.linspace(-90.0, 90.0, 100_001))
    arc = np.array(finger.bone_centre)[:, None] + finger.bone_radius * np.array([np.cos(phi), np.sin(phi)])
    bone = np.hstack([arc, arc[:, [0, -1]] - np.array([[finger.shaft_length], [0.0]])])  # with its edges' far ends
    bone_depth = finger.tip_radius - float((np.array([np.sin(angle), -np.cos(angle)]) @ bone).max())
    assert Scene(finger=finger, friction=Friction(0.3), loading=Loading(0.9999 * bone_depth)).finger is finger
    with pytest.raises(SceneError, match="at which the surface meets the bone"):
        Scene(finger=finger, friction=Friction(0.3), loading=Loading(1.0001 * bone_depth))
