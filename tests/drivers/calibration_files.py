"""The maker's calibration files of two transducers, as published."""

from pathlib import Path

from drivers.calibration_file import parse_calibration_file
from simulators.bench import FT32831

HERE = Path(__file__).parent
NANO43 = (HERE / "FT32831.cal").read_text(encoding="utf-8")  # Nano43 SI-36-0.5, calibrated 12/14/2020
# Its working matrix [N, N mm per V], worked out independently of the driver from the rows of the file.
NANO43_MATRIX = FT32831.tolist()
# Gamma SI-130-10, calibrated 3/5/2014, in N, N-m and m, with the maker's own product as UserAxis.
GAMMA = (HERE / "FT8578.cal").read_text(encoding="utf-8")


def parse(text):
    return parse_calibration_file(text.encode(), "FT.cal")
