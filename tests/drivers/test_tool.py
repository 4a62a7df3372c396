"""The user's tool transform: against closed forms, and against the products the maker prints in its own files."""

import re
from dataclasses import replace

import numpy as np
import pytest
from calibration_files import GAMMA, NANO43, parse
from scipy.spatial.transform import Rotation

from daq_app.simulation.wiring import connect
from drivers.address import parse_address, with_tool, without_tool
from drivers.calibration import loads
from drivers.clock import PacedClock
from drivers.readings import ReadingBlock
from drivers.transducer import SetupError, TransducerInfo
from sessions.recording.head import info_from_dict, info_to_dict

CALIBRATION = parse(NANO43).calibration


def info_with(uri):
    address, tool = without_tool(parse_address(uri))
    assert "tool" not in address.options
    info = TransducerInfo(uri, "net-ft", "Net F/T", "FT32831", False, 200.0, 7000.0, CALIBRATION, {"filter": "off"})
    return with_tool(info, tool)


def test_a_finger_that_presses_on_the_new_origin_exerts_no_torque_about_it():
    point, force = np.array([3.0, -4.0, 20.0]), np.array([0.5, -0.25, -2.0])
    wrench = np.concatenate([force, np.cross(point, force)])  # a force at a point, about the transducer's origin
    raw = np.linalg.solve(CALIBRATION.matrix, wrench)[None]
    moved_wrench = info_with("net-ft://box?tool=3,-4,20,0,0,0").calibration.wrench(raw, np.zeros(6))[0]
    np.testing.assert_allclose(moved_wrench, [*force, 0, 0, 0], atol=1e-9)


def test_a_couple_moved_5_mm_away_changes_by_force_times_lever():
    calibration = info_with("net-ft://box?tool=0,0,-5,0,0,0").calibration
    raw = np.linalg.solve(CALIBRATION.matrix, [1.0, 2.0, 3.0, 10.0, 20.0, 30.0])[None]
    # The maker's library: Tx' = Tx + Dz Fy, Ty' = Ty - Dz Fx.
    np.testing.assert_allclose(
        calibration.wrench(raw, np.zeros(6))[0], [1, 2, 3, 10 - 5 * 2, 20 + 5 * 1, 30], atol=1e-9
    )


def test_turns_follow_each_other_about_x_then_y_then_z():
    calibration = info_with("net-ft://box?tool=0,0,0,90,0,90").calibration
    raw = np.linalg.solve(CALIBRATION.matrix, [1.0, 2.0, 3.0, 10.0, 20.0, 30.0])[None]
    # About x by 90 degrees: new y is old z, new z is old -y. Then about the new z: newest x is new y, newest y new -x.
    np.testing.assert_allclose(calibration.wrench(raw, np.zeros(6))[0], [3, -1, -2, 30, -10, -20], atol=1e-9)


def test_three_turns_are_those_of_axes_that_turn_with_the_tool():
    angles, wrench = (20.0, -35.0, 50.0), np.array([1.0, 2.0, 3.0, 10.0, 20.0, 30.0])
    calibration = info_with("net-ft://box?tool=0,0,0,20,-35,50").calibration
    raw = np.linalg.solve(CALIBRATION.matrix, wrench)[None]
    turned = Rotation.from_euler("XYZ", angles, degrees=True).inv()  # capitals: about the axes that turn
    expected = np.concatenate([turned.apply(wrench[:3]), turned.apply(wrench[3:])])
    np.testing.assert_allclose(calibration.wrench(raw, np.zeros(6))[0], expected, atol=1e-9)


def test_the_makers_own_transform_given_as_a_tool_gives_the_makers_own_product():
    printed_matrix = parse(GAMMA).calibration.matrix  # agrees with the file's UserAxis
    calibration = parse(re.sub(r"<UserAxis[^>]*>", "", GAMMA).replace("0.0120142", "0")).calibration
    assert not np.allclose(calibration.matrix, printed_matrix)
    matrix = calibration.with_tool((0.0, 0.0, 12.0142, 0.0, 0.0, 0.0)).matrix
    np.testing.assert_allclose(matrix, printed_matrix, rtol=1e-12)


def test_it_comes_after_the_files_own_transform():
    # Displacements add where nothing is turned.
    matrix = parse(NANO43.replace("4.3434", "9.3434")).calibration.matrix
    np.testing.assert_allclose(info_with("net-ft://box?tool=0,0,5,0,0,0").calibration.matrix, matrix, rtol=1e-12)


def test_a_range_is_that_of_the_transducers_own_axes():
    calibration = info_with("net-ft://box?tool=0,0,100,0,0,90").calibration
    raw = np.linalg.solve(CALIBRATION.matrix, [18.0, 0.0, 0.0, 0.0, 0.0, 0.0])[None]
    own_wrench = calibration.in_own_frame(calibration.wrench(raw, np.zeros(6)))
    np.testing.assert_allclose(loads(own_wrench, calibration.rated)[0], [0.5, 0, 0, 0, 0, 0, 0.5], atol=1e-12)


def test_it_is_recorded_with_its_origin_and_comes_back():
    info = info_with("net-ft://box?tool=0,0,-5,0,0,45")
    assert info.settings["user's tool transform"] == "0 0 -5 mm, 0 0 45 degrees, as the address says"
    assert "tool transform" in info.calibration.source
    copy = info_from_dict(info_to_dict(info))
    assert copy.calibration.tool == (0.0, 0.0, -5.0, 0.0, 0.0, 45.0)
    np.testing.assert_array_equal(copy.calibration.matrix, info.calibration.matrix)
    assert info_from_dict(info_to_dict(replace(info, calibration=CALIBRATION))).calibration.tool == ()


def test_zeros_are_no_transform():
    assert info_with("net-ft://box?tool=0,0,0,0,0,0").calibration is CALIBRATION


@pytest.mark.parametrize(
    "tool",
    ["", "1,2,3", "1,2,3,4,5,6,7", "0,0,x,0,0,0", "0,0,nan,0,0,0", "0,0,1e9,0,0,0", "0,0,0,0,0,361", "1_0,0,0,0,0,0"],
)
def test_anything_but_six_plausible_numbers_is_refused(tool):
    with pytest.raises(SetupError, match=r"tool=.* must be six numbers, dx,dy,dz in mm"):
        without_tool(parse_address(f"net-ft://box?tool={tool}"))


def test_a_box_that_combines_its_gauges_itself_is_moved_too_and_its_raw_readings_stay():
    clock = PacedClock(10.0)
    with connect("sim:?tool=0,0,20,0,0,0", clock) as bench:
        transducer = bench.transducer
        transducer.start()
        blocks = [transducer.read(1.0) for _ in range(3)]
        transducer.stop()
    block, calibration = ReadingBlock.concatenate(blocks), transducer.info.calibration
    assert transducer.health.received >= len(block) > 0
    own_wrench, moved_wrench = block.raw * np.repeat([1e-6, 1e-3], 3), calibration.wrench(block.raw, np.zeros(6))
    np.testing.assert_allclose(moved_wrench[:, 3], own_wrench[:, 3] + 20.0 * own_wrench[:, 1])
    np.testing.assert_allclose(moved_wrench[:, 4], own_wrench[:, 4] - 20.0 * own_wrench[:, 0])
