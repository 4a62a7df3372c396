"""The page that holds the paper's figures, tables and claims beside what this program makes of them."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import looks
import numpy as np

from sessions.prediction.surface_series import SERIES
from sessions.statistics.correlations import pearson
from solver import Prediction, Solve, solve_many
from solver.quantities import NAMES
from solver.response.receptor_row import rough_responses
from solver.scene.published import Surface, scene

PAGE = Path(__file__).with_name("against-the-paper.md.in")


def page() -> str:
    """Return the page in Markdown."""
    rows_of = {name: _rows(series) for name, series in SERIES.items()}
    text = PAGE.read_text(encoding="utf-8").format(tables=_tables(rows_of), **_numbers(rows_of))
    return text.replace("-0.", "\u22120.")


def _rows(series: tuple[Surface, ...]) -> list[dict[str, float]]:
    """Return for each surface its SED [kPa] with error, slid the other way too, and at finite strain."""
    scenes = [replace(scene(surface), solve=Solve(tolerance=0.005, evidence="quick")) for surface in series]
    opposite = {"+x": "-x", "-x": "+x"}
    loadings = (replace(forth.loading, slide=opposite[forth.loading.slide]) for forth in scenes)
    back = [replace(forth, loading=loading) for forth, loading in zip(scenes, loadings, strict=True)]
    finite = [replace(either, solve=Solve("finite")) for either in (*scenes, *back)]
    small = solve_many([*scenes, *back])
    large = rough_responses(finite)[:, NAMES.index("sed"), 0]
    rows: list[dict[str, float]] = []
    for number, surface in enumerate(series):
        forward, backward = small[number], small[number + len(series)]
        assert isinstance(forward, Prediction)
        rows.append(
            {
                "index": float(surface.index),
                "mu": surface.mu,
                "sed": 1e3 * forward.sed_ending,
                "error": 1e3 * forward.sed_ending * forward.error_estimate,
                "back": 1e3 * backward.sed_ending if isinstance(backward, Prediction) else np.nan,
                "finite": 1e3 * float(large[number]),
                "finite back": 1e3 * float(large[number + len(series)]),
            }
        )
    return rows


def _tables(rows_of: Mapping[str, list[dict[str, float]]]) -> str:
    lines = ["## The ten surfaces", ""]
    for name, rows in rows_of.items():
        direction = "proximal to distal, 2 mm deep" if name == "stickiness" else "distal to proximal, 1.5 mm deep"
        lines += [
            f"{name.capitalize()}, {direction}. SED in kPa; at finite strain on a coarse mesh, good to a few percent.",
            "",
        ]
        header = ("index", "\u00b5", "SED, small strain", "the other way", "SED, finite strain", "the other way")
        cells = [
            (
                f"{row['index']:.0f}",
                f"{row['mu']:.2f}",
                f"{row['sed']:.3f} \u00b1 {row['error']:.3f}",
                *(_or_none(row[key]) for key in ("back", "finite", "finite back")),
            )
            for row in rows
        ]
        lines += looks.table(header, cells)
    return "\n".join(lines)


def _or_none(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "no slide"


def _numbers(rows_of: Mapping[str, list[dict[str, float]]]) -> dict[str, Any]:
    """Return the numbers of the page's sentences, by name; a solver that makes them untrue makes no page."""
    sticky, slippery = rows_of["stickiness"], rows_of["slipperiness"]
    r = {name: pearson([row["index"] for row in rows], [row["sed"] for row in rows]) for name, rows in rows_of.items()}
    bounds = {
        name: pearson([float(surface.index) for surface in series], [surface.printed_bound for surface in series])
        for name, series in SERIES.items()
    }
    small_ratios = [row["sed"] / row["back"] for row in slippery if np.isfinite(row["back"])]
    large = [row["finite"] / row["finite back"] for row in slippery if np.isfinite(row["finite"] / row["finite back"])]
    assert r["stickiness"] > 0.0 > r["slipperiness"]
    assert bounds["stickiness"] > 0.0 > bounds["slipperiness"]
    assert max(*small_ratios, *large) < 1.0
    return {
        "r": r,
        "bounds": bounds,
        "same": (min(small_ratios), max(small_ratios)),
        "large": (min(large), max(large)),
        "highest": {name: max(row["sed"] for row in rows) for name, rows in rows_of.items()},
        "least": min(row["sed"] for row in slippery),
        "lost": sum(not np.isfinite(row["finite"]) for row in sticky),
    }
