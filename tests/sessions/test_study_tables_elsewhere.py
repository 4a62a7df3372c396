"""The study's table opened by other programs: R and pandas read the same numbers, and R comes to the same result."""

import csv
import re
import shutil
import subprocess
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy import stats
from study_example import INDICES, study, visit

from sessions.report.pages import (
    _MEANING,
    columns_csv,
    path_columns_csv,
    paths_csv,
    rival_columns_csv,
    rivals_csv,
    trials_csv,
)
from sessions.report.tables.study import study_tables
from sessions.statistics.pooled import pool_visits
from sessions.statistics.visit import TrialRow

RSCRIPT = shutil.which("Rscript")

R = """
t <- read.csv("trials.csv")
stopifnot(is.numeric(t$score), is.numeric(t$sed_MPa), is.numeric(t$mu), is.character(t$excluded))
stopifnot(all(is.na(t$mu_static)))
for (name in c("mu", "tau_max_MPa", "speed_mm_per_s", "sed_MPa")) {
  part <- strsplit(name, "_(?=MPa|mm)", perl = TRUE)[[1]]
  end <- function(which) t[[paste(c(part[1], which, part[-1]), collapse = "_")]]
  stopifnot(all(end("low") < t[[name]]), all(t[[name]] < end("high")))
}
told <- read.csv("trials-columns.csv")
stopifnot(identical(told$column, names(t)), all(told$meaning != ""))
kept <- t[t$excluded == "", ]
fit <- anova(lm(score ~ factor(subject) + sed_MPa, kept))
ss <- fit[["Sum Sq"]]
p <- read.csv("paths.csv")
usual <- p[p$usual == "yes", ]
cat(sprintf("%d %.17g %.12g %.12g", nrow(t), t$sed_MPa[1], sqrt(ss[2] / (ss[2] + ss[3])), usual$r_within_subjects))
"""


@pytest.fixture(scope="module")
def findings():
    return study()


@pytest.fixture
def folder(findings, tmp_path):
    (tmp_path / "trials.csv").write_text(trials_csv(findings), encoding="utf-8")
    (tmp_path / "trials-columns.csv").write_text(columns_csv(findings), encoding="utf-8")
    (tmp_path / "paths.csv").write_text(paths_csv(findings), encoding="utf-8")
    return tmp_path


def test_every_field_of_a_trial_has_a_column_with_its_meaning(findings):
    heads = trials_csv(findings).splitlines()[0].split(",")
    assert heads == [row[0] for row in list(csv.reader(columns_csv(findings).splitlines()))[1:]]
    assert {field.name for field in fields(TrialRow)} - {"paths", "responses"} == set(_MEANING)
    assert {"stretch_along_skin", "von_mises_mpa"} <= {head.lower() for head in heads}


@pytest.mark.parametrize(("table", "columns"), [(rivals_csv, rival_columns_csv), (paths_csv, path_columns_csv)])
def test_every_column_of_rivals_and_paths_has_a_meaning_and_the_error_a_unit(findings, table, columns):
    heads = table(findings).splitlines()[0].split(",")
    rows = [*csv.DictReader(columns(findings).splitlines())]
    assert heads == [row["column"] for row in rows]
    assert all(row["meaning"] for row in rows)
    units = {row["column"]: row["unit"] for row in rows if row["unit"]}
    assert units == ({"left_out_error": "points"} if table is rivals_csv else {})


@pytest.mark.skipif(RSCRIPT is None, reason="no R to open the table in")
def test_r_opens_the_table_and_comes_to_the_same_correlation_within_subjects(findings, folder):
    (folder / "read.R").write_text(R, encoding="utf-8")
    process = subprocess.run([RSCRIPT, "--vanilla", "read.R"], cwd=folder, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr
    rows, first, r, usual = process.stdout.split()
    assert int(rows) == sum(len(visit.rows) for visit in findings.visits)
    assert float(first) == findings.visits[0].rows[0].sed
    # The correlation within subjects is that of an analysis of covariance (Bland & Altman 1995).
    assert float(r) == pytest.approx(findings.descriptors[0].repeated.r, rel=1e-9)
    assert float(usual) == pytest.approx(float(r), rel=1e-9)


def test_pandas_opens_the_table_with_every_number(findings, folder):
    pandas = pytest.importorskip("pandas")
    table = pandas.read_csv(folder / "trials.csv")
    rows = [row for visit in findings.visits for row in visit.rows]
    assert table["sed_MPa"].tolist() == pytest.approx([row.sed for row in rows], rel=1e-14)
    assert table["score"].tolist() == pytest.approx([row.score for row in rows], rel=1e-14)
    assert table.dtypes["index"] == "int64"
    assert table["sed_low_MPa"].tolist() == pytest.approx([row.sed_low for row in rows], rel=1e-14)
    columns = pandas.read_csv(folder / "trials-columns.csv", keep_default_na=False)
    assert columns["column"].tolist() == table.columns.tolist()
    assert table["excluded"].notna().sum() == 5  # the five trials of the one subject left out


def test_scipy_comes_to_the_same_geometric_means_of_magnitude_estimates():
    rng = np.random.default_rng(4)
    estimates = np.outer((3.0, 40.0, 11.0, 7.0), (1.0, 1.5, 2.2, 3.0, 5.0)) * rng.lognormal(0.0, 0.2, (4, 5))
    visits = [
        replace(v, rows=tuple(replace(row, score=None, estimate=by_index[row.index]) for row in v.rows))
        for v, values in zip(map(visit, range(1, 5)), estimates.tolist(), strict=True)
        for by_index in [dict(zip(INDICES, values, strict=True))]
    ]
    nothing = visit(5)
    nothing = replace(nothing, rows=tuple(replace(row, score=None, estimate=0.0) for row in nothing.rows))
    tables = study_tables(pool_visits([*visits, nothing]))
    table = next(table for section in tables.values() for table in section if table.name == "table-estimates")
    assert "Left out for an estimate that is not above 0: stickiness: S05." in table.caption
    at_one_modulus = estimates / stats.gmean(estimates, axis=1)[:, None] * stats.gmean(estimates, axis=None)
    for row, *columns in zip(table.groups[0].rows, estimates.T, at_one_modulus.T, strict=True):
        assert row[1].text == "4"
        for mean, ends, column in zip(row[2::2], row[3::2], columns, strict=True):
            low, high = np.exp(stats.t.interval(0.95, 3, np.log(column).mean(), stats.sem(np.log(column))))
            texts = [mean.text, *ends.text.split(" to ")]
            assert [float(text) for text in texts] == pytest.approx([stats.gmean(column), low, high], rel=0.005)


def test_the_page_s_table_of_trials_has_the_numbers_of_the_visits_in_its_units(findings):
    tables = study_tables(findings)
    table = next(table for section in tables.values() for table in section if table.name == "table-trials")
    units = {"mu": 1.0, "tau_max": 1e3, "normal_force": 1.0, "speed": 1.0, "sed": 1e3}
    rows = [row for visit in findings.visits for row in visit.rows]
    cells = [row for group in table.groups for row in group.rows]
    for row, (trial, index, score, *numbers, error, flaws) in zip(rows, cells, strict=True):
        assert [trial.text, index.text] == [str(row.trial), str(row.index)]
        assert float(score.text) == pytest.approx(row.score, abs=0.051)
        assert float(error.text) == pytest.approx(100 * row.error_estimate)
        assert flaws.text == (", ".join(row.flaws).replace("_", " ") or "none")
        for (name, factor), cell in zip(units.items(), numbers, strict=True):
            expected = [factor * getattr(row, f"{name}{end}") for end in ("", "_low", "_high")]
            texts = [cell.text, *cell.interval.split(" to ")]
            assert [float(text) for text in texts] == pytest.approx(expected, rel=0.005)


def figures(cell):
    """Return the numbers in a cell and in the interval under it."""
    text = f"{cell.text} {cell.interval}".replace("−", "-")
    return [float(number) for number in re.findall(r"-?[\d.]+", text)]


def mean_and_interval(values):
    return [values.mean(), *stats.t.interval(0.95, len(values) - 1, values.mean(), stats.sem(values))]


def test_pandas_and_scipy_come_to_the_page_s_means_of_surfaces_and_differences_of_scores(findings, folder):
    pandas = pytest.importorskip("pandas")
    trials = pandas.read_csv(folder / "trials.csv")
    counted = trials[trials["excluded"].isna()]
    tables = {table.name: table for section in study_tables(findings).values() for table in section}
    lines = {name: {row[0].text: row[1:] for row in table.groups[0].rows} for name, table in tables.items()}
    scores = counted.pivot_table(index="subject", columns="index", values="score")
    level = scores.sub(scores.mean(axis=1), axis=0) + scores.stack().mean()
    surfaces = scores.shape[1]
    for index, rows in counted.groupby("index"):
        n, mean, interval, within, sd = lines["table-scores"][str(index)]
        assert n.text == str(len(rows))
        assert figures(mean) + figures(interval) == pytest.approx(mean_and_interval(rows["score"]), abs=0.051)
        assert figures(sd)[0] == pytest.approx(rows["score"].std(), abs=0.051)
        # Without the subjects' own levels (Cousineau 2005), by the correction of Morey (2008).
        half = stats.t.ppf(0.975, len(rows) - 1) * stats.sem(level[index]) * (surfaces / (surfaces - 1)) ** 0.5
        assert figures(within) == pytest.approx([rows["score"].mean() - half, rows["score"].mean() + half], abs=0.051)
        _, *cells = lines["table-surfaces"][str(index)]
        assert figures(cells[0]) + figures(cells[1]) == pytest.approx(mean_and_interval(rows["mu"]), abs=5.1e-4)
        sed = 1e3 * rows["sed_MPa"]
        assert figures(cells[2]) + figures(cells[3]) == pytest.approx(mean_and_interval(sed), abs=5.1e-4)
        assert figures(cells[4])[0] == pytest.approx(sed.std(), rel=0.051)
        _, *cells = lines["table-forces"][str(index)]
        for n, name in enumerate(("normal_force_N", "model_normal_force_N", "matching_depth_mm")):
            expected = mean_and_interval(rows[name])
            assert figures(cells[2 * n]) + figures(cells[2 * n + 1]) == pytest.approx(expected, abs=0.0051)
    for name, (n, difference, interval, *_) in lines["table-differences"].items():
        high, low = (scores[int(index)] for index in name.split(" − "))
        test = stats.ttest_rel(high, low)
        assert n.text == str(len(scores))
        expected = [(high - low).mean(), *test.confidence_interval(0.95)]
        assert figures(difference) + figures(interval) == pytest.approx(expected, abs=0.051)
