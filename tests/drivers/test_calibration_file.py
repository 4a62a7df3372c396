"""The maker's calibration file. Expected numbers: ATI's published files, and hand-computed products of their rows."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.calibration import wrench_transform
from drivers.calibration_file import LONGEST, parse_calibration_file, read_calibration_file
from drivers.transducer import SetupError

SAMPLES = Path(__file__).parents[3] / "shared" / "reference" / "samples"
needs_samples = pytest.mark.skipif(
    not SAMPLES.is_dir(), reason="the makers' sample files are not beside this repository"
)

# FT32831, Nano43 SI-36-0.5, calibrated 12/14/2020: the file's own numbers.
NANO43 = """<?xml version="1.0" encoding="utf-8"?>
<!-- a comment -->
<FTSensor Serial="FT32831" BodyStyle="Nano43" Family="DAQ" NumGages="6" CalFileVersion="1.1">
 <Calibration PartNumber="SI-36-0.5" CalDate="12/14/2020" ForceUnits="N" TorqueUnits="N-mm" DistUnits="mm"
   OutputMode="Ground Referenced Differential" OutputRange="20" HWTempComp="True" GainMultiplier="1">
 <Axis Name="Fx" values="0.17124 -0.23480 -0.42753 36.86148 -0.44469 -36.43208" max="36" scale="8.1634377013728"/>
 <Axis Name="Fy" values="-1.11998 -41.82688 -0.34426 21.11841 0.32722 20.58933" max="36" scale="8.1634377013728"/>
 <Axis Name="Fz" values="20.64039 -0.11474 20.88593 0.15774 20.81387 0.08546" max="36" scale="6.93470571615175"/>
 <Axis Name="Tx" values="-0.17249 -0.69307 36.14830 0.63283 -35.99689 0.26524" max="500" scale="0.825836392458168"/>
 <Axis Name="Ty" values="-41.68215 0.33486 20.86280 -0.56441 20.56406 0.66095" max="500" scale="0.825836392458168"/>
 <Axis Name="Tz" values="-0.72205 -22.00406 0.30563 -21.35581 -0.24436 -21.47014" max="500" scale="0.574757166607079"/>
  <BasicTransform Dx="0" Dy="0" Dz="4.3434" Rx="0" Ry="0" Rz="0"/>
 </Calibration>
</FTSensor>
"""

# Its working matrix [N, N mm per V], worked out independently of this program from the rows above.
NANO43_MATRIX = [
    [0.02098, -0.02876, -0.05237, 4.51544, -0.05447, -4.46284],
    [-0.13719, -5.12368, -0.04217, 2.58695, 0.04008, 2.52214],
    [2.97639, -0.01655, 3.01180, 0.02275, 3.00141, 0.01232],
    [-0.80476, -23.09345, 43.58858, 12.00245, -43.41430, 11.27584],
    [-50.56376, 0.53041, 25.49010, -20.29578, 25.13749, 20.18422],
    [-1.25627, -38.28410, 0.53176, -37.15623, -0.42515, -37.35515],
]

# FT8578, Gamma SI-130-10, calibrated 3/5/2014, in N, N-m and m, with the maker's own product as UserAxis.
GAMMA = """<FTSensor Serial="FT8578" BodyStyle="Gamma" Family="DAQ" NumGages="6" CalFileVersion="1.1">
 <Calibration PartNumber="SI-130-10" CalDate="3/5/2014" ForceUnits="N" TorqueUnits="N-m"
   DistUnits="m" GainMultiplier="1">
 <Axis Name="Fx" values="-0.27053 -0.14278 0.35224 -32.30108 -0.22111 32.83006" max="130" scale="2.33993181642138"/>
 <Axis Name="Fy" values="0.21616 37.46357 0.05722 -18.83819 0.35126 -18.85998" max="130" scale="2.33993181642138"/>
 <Axis Name="Fz" values="18.48980 -0.25078 18.75502 -0.41293 18.60017 -0.58878" max="400" scale="0.747981765296576"/>
 <Axis Name="Tx" values="0.05325 0.15667 -32.28492 0.82744 32.26505 -1.25235" max="10" scale="44.8196831994584"/>
 <Axis Name="Ty" values="37.31421 -0.62445 -18.43472 0.63319 -18.48677 0.60638" max="10" scale="44.8196831994584"/>
 <Axis Name="Tz" values="-0.13536 -18.46474 0.04406 -18.57097 0.27123 -18.80438" max="10" scale="43.1398206760749"/>
  <BasicTransform Dx="0" Dy="0" Dz="0.0120142" Rx="0" Ry="0" Rz="0"/>
 <UserAxis Name="Fx" values="-0.11562 -0.06102 0.15054 -13.80428 -0.09449 14.03035" max="130"/>
 <UserAxis Name="Fy" values="0.09238 16.01054 0.02446 -8.05074 0.15012 -8.06005" max="130"/>
 <UserAxis Name="Fz" values="24.71959 -0.33527 25.07417 -0.55206 24.86714 -0.78715" max="400"/>
 <UserAxis Name="Tx" values="0.00230 0.19585 -0.72004 -0.07826 0.72169 -0.12478" max="10"/>
 <UserAxis Name="Ty" values="0.83393 -0.01320 -0.41312 0.17997 -0.41133 -0.15503" max="10"/>
 <UserAxis Name="Tz" values="-0.00314 -0.42802 0.00102 -0.43048 0.00629 -0.43589" max="10"/>
 </Calibration>
</FTSensor>
"""


def parsed(text):
    return parse_calibration_file(text.encode(), "FT.cal")


def test_a_nano43_file_gives_the_working_matrix_and_range():
    found = parsed(NANO43)
    np.testing.assert_allclose(found.calibration.matrix, NANO43_MATRIX, atol=0.6e-5)
    np.testing.assert_array_equal(found.calibration.rated, [36, 36, 36, 500, 500, 500])
    assert (found.calibration.serial, found.calibration.raw_unit) == ("FT32831", "V")
    assert (found.body, found.part_number, found.calibrated) == ("Nano43", "SI-36-0.5", "2020-12-14")
    assert found.calibration.source == "FT.cal: Nano43 SI-36-0.5, calibrated 2020-12-14"
    assert not found.checked


def test_five_newtons_along_z_need_the_gauge_voltages_worked_out_by_hand():
    volts = np.array([[0.554, -0.016, 0.557, 0.005, 0.557, -0.006]])  # rounded to a millivolt: up to 9 mN, 0.2 N mm
    wrench = parsed(NANO43).calibration.wrench(volts, np.zeros(6))[0]
    np.testing.assert_allclose(wrench[:3], [0, 0, 5], atol=0.01)
    np.testing.assert_allclose(wrench[3:], [0, 0, 0], atol=0.1)


def test_a_file_in_newton_metres_gives_newton_millimetres_and_agrees_with_its_own_product():
    found = parsed(GAMMA)
    assert found.checked
    np.testing.assert_array_equal(found.calibration.rated, [130, 130, 400, 10000, 10000, 10000])
    np.testing.assert_allclose(found.calibration.matrix[3, :3], [2.30, 195.85, -720.04], atol=0.02)


def test_a_file_that_contradicts_its_own_product_is_refused():
    with pytest.raises(
        SetupError, match=r"UserAxis Ty says 834\.93000 for gauge 0 where its Axis rows give 833\.92971"
    ):
        parsed(GAMMA.replace("0.83393", "0.83493"))
    with pytest.raises(SetupError, match="UserAxis"):
        parsed(GAMMA.replace("0.0120142", "0.0134355"))


def test_some_but_not_all_user_axes_are_no_check():
    lines = [line for line in GAMMA.splitlines() if 'UserAxis Name="Tz"' not in line]
    assert not parsed("\n".join(lines)).checked


def test_the_hash_is_that_of_the_bytes():
    assert parsed(GAMMA).sha256 == hashlib.sha256(GAMMA.encode()).hexdigest()


def test_a_turn_about_z_by_a_right_angle_makes_y_the_new_x():
    turned = wrench_transform(np.zeros(3), np.array([0.0, 0.0, np.pi / 2])) @ np.array([0, 3.0, 0, 0, 7.0, 0])
    np.testing.assert_allclose(turned, [3, 0, 0, 7, 0, 0], atol=1e-12)


def test_a_displaced_origin_changes_torque_by_minus_the_lever_times_force():
    d, force, torque = np.array([1.0, 2.0, 3.0]), np.array([4.0, -5.0, 6.0]), np.array([7.0, 8.0, 9.0])
    moved = wrench_transform(d, np.zeros(3)) @ np.concatenate([force, torque])
    np.testing.assert_allclose(moved, [*force, *(torque - np.cross(d, force))], atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
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
def test_what_cannot_be_trusted_is_refused_with_the_reason(old, new, complaint):
    with pytest.raises(SetupError, match=complaint) as refused:
        parsed(NANO43.replace(old, new, 1))
    assert str(refused.value).startswith("FT.cal: ")
    assert "\n" not in str(refused.value)


def test_a_document_type_with_entities_is_refused_before_it_can_grow():
    bomb = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]>'
    with pytest.raises(SetupError, match="document type"):
        parsed(NANO43.replace("<FTSensor", bomb + "<FTSensor", 1).replace("FT32831", "&b;"))


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


@given(at=st.integers(0, len(NANO43)), gone=st.integers(0, 40), put=st.text(max_size=12))
def test_a_damaged_file_is_read_or_refused_and_nothing_else(at, gone, put):
    text = NANO43[:at] + put + NANO43[at + gone :]
    try:
        found = parse_calibration_file(text.encode("utf-8", "surrogatepass"), "FT.cal")
    except SetupError:
        pass
    else:
        assert np.all(np.isfinite(found.calibration.matrix))
        assert np.all(found.calibration.rated > 0.0)


@needs_samples
@pytest.mark.parametrize("path", sorted(SAMPLES.glob("*.cal")), ids=lambda path: path.stem)
def test_every_published_file_is_read_and_agrees_with_itself(path):
    found = read_calibration_file(path)
    assert found.calibration.serial == path.stem.split("_")[0]
    assert found.body == path.stem.split("_")[1]
    assert found.checked == (b"<UserAxis" in path.read_bytes())
    assert found.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
