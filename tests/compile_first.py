"""Has compiled loops and bytecode made once, so that test workers that start together do not each make them."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from solver import solve, stepper
from solver.scene.published import SLIPPERINESS, scene

if __name__ == "__main__":
    for kinematics in ("small", "finite"):
        published = scene(SLIPPERINESS[-1])
        variant = replace(published, solve=replace(published.solve, kinematics=kinematics))
        solve(variant)
        solve(replace(variant, solve=replace(variant.solve, course="history")))
        stepper(variant).step(0.05, 0.01)
    if not any(Path(__file__).parent.rglob("*-pytest-*.pyc")):  # pytest keeps bytecode of its own of every test
        subprocess.run([sys.executable, "-m", "pytest", "-q", "--collect-only"], stdout=subprocess.DEVNULL, check=False)
