"""The gauges of a published transducer: what turns their voltages into a wrench, and a file that says so."""

from pathlib import Path

import numpy as np

from simulators.bench import RATED

# Nano43 FT32831, SI-36-0.5, calibrated 2020-12-14: N and N mm per volt of gauge, in the maker's sensing frame.
FT32831 = np.array(
    [
        [0.02098, -0.02876, -0.05237, 4.51544, -0.05447, -4.46284],
        [-0.13719, -5.12368, -0.04217, 2.58695, 0.04008, 2.52214],
        [2.97639, -0.01655, 3.01180, 0.02275, 3.00141, 0.01232],
        [-0.80476, -23.09345, 43.58858, 12.00245, -43.41430, 11.27584],
        [-50.56376, 0.53041, 25.49010, -20.29578, 25.13749, 20.18422],
        [-1.25627, -38.28410, 0.53176, -37.15623, -0.42515, -37.35515],
    ]
)


def calibration_file(folder: Path, serial: str) -> Path:
    """Write the maker's file for simulated gauges of that serial number; return where."""
    axes = "".join(
        f'<Axis Name="{name}" values="{" ".join(map(repr, row))}" max="{rated}" scale="1"/>\n'
        for name, row, rated in zip(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), FT32831.tolist(), RATED, strict=True)
    )
    path = folder / f"{serial}.cal"
    path.write_text(
        f'<?xml version="1.0"?><FTSensor Serial="{serial}" BodyStyle="Nano43" Family="DAQ" NumGages="6" '
        'CalFileVersion="1.0"><Calibration PartNumber="SIMULATED SI-36-0.5" CalDate="12/14/2020" ForceUnits="N" '
        'TorqueUnits="N-mm" DistUnits="mm" OutputMode="Ground Referenced Differential" OutputRange="20">\n'
        f"{axes}</Calibration></FTSensor>\n",
        encoding="utf-8",
    )
    return path
