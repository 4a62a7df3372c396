"""The page that holds the paper's figures, tables and claims beside what this program makes of them."""

from collections.abc import Mapping
from dataclasses import replace

import looks
import numpy as np

from sessions.prediction.surface_series import SERIES
from sessions.statistics.correlations import pearson
from solver import Prediction, Solve, solve_many
from solver.quantities import NAMES
from solver.response.receptor_row import rough_responses
from solver.scene.published import Surface, scene

HEAD = """# Against the paper, point by point

The program follows one paper on friction by touch. This page lists its figures, tables and claims, and what the program makes of
each. The numbers are computed when the documentation is built: settled sliding on the
published finger, friction as printed, \u03c4 max as force over area.

"""
POINTS = """## What the paper shows

| in the paper | here |
| --- | --- |
| Fig. 1, setup: a plate on a six-axis transducer, surfaces changed on a magnet | Net F/T, NI and serial transducers of ATI, and a simulated bench; a session names each surface to mount |
| Fig. 2, mean scores of ten subjects with 95 % intervals | a study's page, from a lab's own subjects; the printed scores are not in the program |
| Figs 3 and 4, forces of each stroke | the report's appendix: the strokes of each series laid over each other, N and T apart |
| Tables 1 and 2, \u00b5, \u03c4 max and speed | taken as they are; \u03c4 max is read as force over 1 cm\u00b2, a hundred times what the heading says |
| Table 3, stiffness of the tissues | taken as it is |
| Fig. 5, speed of the finger | slope of the centre of pressure over the steady window |
| Fig. 6, outline of the finger | a half-disc and straight edges: the picture is schematic, and only some lengths are printed |
| Fig. 7, strain energy in the finger | the picture of the finger in reports and in the window |
| Fig. 8, response over time, about 2 mm deep | the course of each prediction; 1.9 mm deep, averaged over an ending of 0.2 by 1 mm |
| Fig. 9, response against one subject's scores | the response against mean scores, and beside them those of whoever made the strokes |

"""


def page() -> str:
    """Return the page in Markdown."""
    rows_of = {name: _solved(series) for name, series in SERIES.items()}
    return HEAD + POINTS + _tables(rows_of) + _claims(rows_of)


def _solved(series: tuple[Surface, ...]) -> list[dict[str, float]]:
    """Return for each surface its SED [kPa] with error, slid the other way too, and at finite strain."""
    scenes = [replace(scene(one), solve=Solve(tolerance=0.005, evidence="quick")) for one in series]
    other = {"+x": "-x", "-x": "+x"}
    back = [replace(one, loading=replace(one.loading, slide=other[one.loading.slide])) for one in scenes]
    finite = [replace(one, solve=Solve("finite")) for one in (*scenes, *back)]
    small = solve_many([*scenes, *back])
    large = rough_responses(finite)[:, NAMES.index("sed"), 0]
    rows: list[dict[str, float]] = []
    for number, surface in enumerate(series):
        here, there = small[number], small[number + len(series)]
        assert isinstance(here, Prediction)
        rows.append(
            {
                "index": float(surface.index),
                "mu": surface.mu,
                "sed": 1e3 * here.sed_ending,
                "error": 1e3 * here.sed_ending * here.error_estimate,
                "back": 1e3 * there.sed_ending if isinstance(there, Prediction) else np.nan,
                "finite": 1e3 * float(large[number]),
                "finite back": 1e3 * float(large[number + len(series)]),
            }
        )
    return rows


def _tables(rows_of: Mapping[str, list[dict[str, float]]]) -> str:
    lines = ["## The ten surfaces", ""]
    for name, rows in rows_of.items():
        way = "proximal to distal, 2 mm deep" if name == "stickiness" else "distal to proximal, 1.5 mm deep"
        lines += [
            f"{name.capitalize()}, {way}. SED in kPa; at finite strain on a coarse mesh, good to a few percent.",
            "",
        ]
        head = ("index", "\u00b5", "SED, small strain", "the other way", "SED, finite strain", "the other way")
        cells = [
            (
                f"{row['index']:.0f}",
                f"{row['mu']:.2f}",
                f"{row['sed']:.3f} \u00b1 {row['error']:.3f}",
                *(_or_none(row[key]) for key in ("back", "finite", "finite back")),
            )
            for row in rows
        ]
        lines += looks.table(head, cells)
    return "\n".join(lines) + "\n"


def _or_none(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "no slide"


def _claims(rows_of: Mapping[str, list[dict[str, float]]]) -> str:
    sticky, slippery = rows_of["stickiness"], rows_of["slipperiness"]
    r = {name: pearson([row["index"] for row in rows], [row["sed"] for row in rows]) for name, rows in rows_of.items()}
    bounds = {
        name: pearson([float(one.index) for one in series], [one.printed_bound for one in series])
        for name, series in SERIES.items()
    }
    same = [row["sed"] / row["back"] for row in slippery if np.isfinite(row["back"])]
    large = [row["finite"] / row["finite back"] for row in slippery if np.isfinite(row["finite"] / row["finite back"])]
    ends = max(row["sed"] for row in slippery), max(row["sed"] for row in sticky)
    least = min(row["sed"] for row in slippery)
    lost = sum(not np.isfinite(row["finite"]) for row in sticky)
    # The sentences below say this: a solver that no longer does makes no page.
    assert r["stickiness"] > 0.0 > r["slipperiness"]
    assert bounds["stickiness"] > 0.0 > bounds["slipperiness"]
    assert max(*same, *large) < 1.0
    lines = [
        "## What the paper claims",
        "",
        "**The energy rises with stickiness and falls with slipperiness.** At small strain it does: r with the index is "
        f"{r['stickiness']:+.2f} and {r['slipperiness']:+.2f}. The sign hangs on the finger, and friction alone orders the "
        "surfaces alike: see [which response, and on which finger](../../explanation/which-response.md).",
        "",
        "**Surface 55 is an anomaly of one stroke.** Its printed \u00b5 of 0.44 lies below that of surface 75, 0.52, and the "
        "energy follows \u00b5. \u03c4 max has no such anomaly.",
        "",
        "**At equal depth the energy is much higher for the backward movement.** It does not follow from the model. Slid "
        f"distal to proximal, the slippery surfaces have {min(same):.2f} to {max(same):.2f} times the energy of the same press "
        f"slid forward at small strain, and {min(large):.2f} to {max(large):.2f} times at finite strain where both exist. The "
        f"paper's two series are pressed to unequal depths: up to {ends[0]:.1f} kPa at 1.5 mm, and up to {ends[1]:.1f} kPa at "
        f"2 mm.",
        "",
        f"**The response is steady while the finger slides.** At small strain all ten surfaces settle; the least energy is "
        f"{least:.1f} kPa. At finite strain {lost} of the five sticky surfaces have no full slip at 2 mm: the finger wedges.",
        "",
        "**The greatest tangential force goes with the index.** It does: r of \u03c4 max with the index is "
        f"{bounds['stickiness']:+.2f} and {bounds['slipperiness']:+.2f}, and no surface is out of order. So forces alone "
        "follow the scores as well as the energy does. Every report shows such rivals beside the model.",
        "",
        "**T/N climbs to a critical value on sticky surfaces, and not on slippery ones.** The analysis looks for a break-away "
        "in every stroke, whatever its direction. A static peak needs evidence against stick-slip and against friction that "
        "falls with N.",
        "",
        "**Changes of speed and normal force matter little.** The model's tissue does not flow unless a scene says so, so speed "
        "changes nothing in the settled slide. Normal force does: at the measured forces the model lies 1.9 to 3.5 mm deep, "
        "and under one force the energy falls over the sticky surfaces.",
        "",
        "**The scores lie near the maker's indices.** They are printed as a picture only, so this is not held against numbers.",
        "",
        "**The receptor is an SA-II.** The paper also calls it SA-I, in its Figures 8 and 9. At that depth and size it is a "
        "Ruffini ending, so SA-II; `solve --row` gives every response at the depths of SA-I and RA endings.",
        "",
        "**The depth of the press stands for free exploration.** The finger that was measured pressed with forces, not to depths.",
        "",
    ]
    return "\n".join(lines).replace(" -0.", " \u22120.")
