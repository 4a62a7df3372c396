"""The maker's calibration file. Expected numbers: ATI's published files, and hand-computed products of their rows."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from calibration_files import GAMMA, NANO43, NANO43_MATRIX, parse
from hypothesis import given
from hypothesis import strategies as st

from drivers.calibration import wrench_transform
from drivers.calibration_file import LONGEST, parse_calibration_file, read_calibration_file
from drivers.transducer import SetupError

SAMPLES = Path(__file__).parents[3] / "shared" / "reference" / "samples"
needs_samples = pytest.mark.skipif(
    not SAMPLES.is_dir(), reason="the makers' sample files are not beside this repository"
)


def test_a_nano43_file_gives_the_working_matrix_and_range():
    file = parse(NANO43)
    np.testing.assert_allclose(file.calibration.matrix, NANO43_MATRIX, atol=0.6e-5)
    np.testing.assert_array_equal(file.calibration.rated, [36, 36, 36, 500, 500, 500])
    assert (file.calibration.serial, file.calibration.raw_unit) == ("FT32831", "V")
    assert (file.body, file.part_number, file.calibrated) == ("Nano43", "SI-36-0.5", "2020-12-14")
    assert file.calibration.source == "FT.cal: Nano43 SI-36-0.5, calibrated 2020-12-14"
    assert not file.checked


def test_five_newtons_along_z_need_the_gauge_voltages_worked_out_by_hand():
    volts = np.array([[0.554, -0.016, 0.557, 0.005, 0.557, -0.006]])  # rounded to a millivolt: up to 9 mN, 0.2 N mm
    wrench = parse(NANO43).calibration.wrench(volts, np.zeros(6))[0]
    np.testing.assert_allclose(wrench[:3], [0, 0, 5], atol=0.01)
    np.testing.assert_allclose(wrench[3:], [0, 0, 0], atol=0.1)


def test_a_file_in_newton_metres_gives_newton_millimetres_and_agrees_with_its_own_product():
    file = parse(GAMMA)
    assert file.checked
    np.testing.assert_array_equal(file.calibration.rated, [130, 130, 400, 10000, 10000, 10000])
    np.testing.assert_allclose(file.calibration.matrix[3, :3], [2.30, 195.85, -720.04], atol=0.02)


def test_a_file_that_contradicts_its_own_product_is_refused():
    with pytest.raises(
        SetupError, match=r"UserAxis Ty says 834\.93000 for gauge 0 where its Axis rows give 833\.92971"
    ):
        parse(GAMMA.replace("0.83393", "0.83493"))
    with pytest.raises(SetupError, match="UserAxis"):
        parse(GAMMA.replace("0.0120142", "0.0134355"))


def test_some_but_not_all_user_axes_are_no_check():
    lines = [line for line in GAMMA.splitlines() if 'UserAxis Name="Tz"' not in line]
    assert not parse("\n".join(lines)).checked


def test_the_hash_is_that_of_the_bytes():
    assert parse(GAMMA).sha256 == hashlib.sha256(GAMMA.encode()).hexdigest()


def test_a_turn_about_z_by_a_right_angle_makes_y_the_new_x():
    wrench = wrench_transform(np.zeros(3), np.array([0.0, 0.0, np.pi / 2])) @ np.array([0, 3.0, 0, 0, 7.0, 0])
    np.testing.assert_allclose(wrench, [3, 0, 0, 7, 0, 0], atol=1e-12)


def test_a_displaced_origin_changes_torque_by_minus_the_lever_times_force():
    displacement, force, torque = np.array([1.0, 2.0, 3.0]), np.array([4.0, -5.0, 6.0]), np.array([7.0, 8.0, 9.0])
    wrench = wrench_transform(displacement, np.zeros(3)) @ np.concatenate([force, torque])
    np.testing.assert_allclose(wrench, [*force, *(torque - np.cross(displacement, force))], atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('Family="DAQ"', 'Family="TWE"', "Family is 'TWE'"),
        ('NumGages="6"', 'NumGages="7"', "NumGages"),
        ('CalFileVersion="1.1"', 'CalFileVersion="2.0"', "CalFileVersion"),
        ('GainMultiplier="1"', 'GainMultiplier="2"', "GainMultiplier"),
        ('ForceUnits="N"', 'ForceUnits="dyn"', "ForceUnits is 'dyn'"),
        ('DistUnits="mm"', "", "DistUnits is ''"),
        ('Serial="FT32831"', "", "names no Serial"),
        ('max="36" scale="8.1634377013728"', 'max="36" scale="0"', "scale of Fx is '0'"),
        ('max="36" scale="8.1634377013728"', 'max="x" scale="8"', "max of Fx is 'x'"),
        ("-0.23480", "-0,23480", "axis Fx has not six numbers"),
        ("-0.23480", "nan", "axis Fx has not six numbers"),
        ("-0.23480 ", "", "axis Fx has not six numbers"),
        ("-0.23480", "1e300", "do not make a matrix"),
        ('Name="Fy"', 'Name="Fx"', "Axis 'Fx' is double"),
        ("<BasicTransform", "<Thermistor value='2'/><BasicTransform", "temperature compensation in software"),
        ("</FTSensor>", "", "not sound XML"),
        ("<FTSensor ", "<Other ", "not sound XML"),
        ('encoding="utf-8"', 'encoding="klingon"', "encoding"),
    ],
)
def test_what_cannot_be_trusted_is_refused_with_the_reason(old, new, reason):
    with pytest.raises(SetupError, match=reason) as refusal:
        parse(NANO43.replace(old, new, 1))
    assert str(refusal.value).startswith("FT.cal: ")
    assert "\n" not in str(refusal.value)


def test_a_document_type_with_entities_is_refused_before_it_can_grow():
    bomb = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]>'
    with pytest.raises(SetupError, match="document type"):
        parse(NANO43.replace("<FTSensor", bomb + "<FTSensor", 1).replace("FT32831", "&b;"))


def test_a_file_that_is_too_long_is_refused(tmp_path):
    path = tmp_path / "long.cal"
    path.write_bytes(NANO43.encode() + b" " * LONGEST)
    with pytest.raises(SetupError, match="longer than"):
        read_calibration_file(path)


@pytest.mark.parametrize("name", ["nowhere.cal", ".", "a\0b"])
def test_a_file_that_cannot_be_read_is_named(tmp_path, name):
    with pytest.raises(SetupError, match="cannot be read"):
        read_calibration_file(tmp_path / name)


def test_a_file_may_be_named_from_the_home_of_whoever_uses_it(tmp_path, monkeypatch):
    for variable in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(variable, str(tmp_path))
    (tmp_path / "FT.cal").write_text(NANO43)
    assert read_calibration_file(Path("~/FT.cal")).calibration.serial == "FT32831"
    with pytest.raises(SetupError, match="cannot be read"):
        read_calibration_file(Path("~nobody-of-that-name/FT.cal"))


@given(st.binary(max_size=300))
def test_bytes_that_are_no_file_are_refused(data):
    with pytest.raises(SetupError):
        parse_calibration_file(data, "FT.cal")


@given(start=st.integers(0, len(NANO43)), length=st.integers(0, 40), insertion=st.text(max_size=12))
def test_a_damaged_file_is_read_or_refused_and_nothing_else(start, length, insertion):
    text = NANO43[:start] + insertion + NANO43[start + length :]
    try:
        file = parse_calibration_file(text.encode("utf-8", "surrogatepass"), "FT.cal")
    except SetupError:
        pass
    else:
        assert np.all(np.isfinite(file.calibration.matrix))
        assert np.all(file.calibration.rated > 0.0)


@needs_samples
@pytest.mark.parametrize("path", sorted(SAMPLES.glob("*.cal")), ids=lambda path: path.stem)
def test_every_published_file_is_read_and_agrees_with_itself(path):
    file = read_calibration_file(path)
    assert file.calibration.serial == path.stem.split("_")[0]
    assert file.body == path.stem.split("_")[1]
    assert file.checked == (b"<UserAxis" in path.read_bytes())
    assert file.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
