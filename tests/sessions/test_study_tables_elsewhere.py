"""The study's table opened by other programs: R and pandas read the same numbers, and R comes to the same result."""

import csv
import shutil
import subprocess
from dataclasses import fields

import pytest
from study_example import study

from sessions.report.pages import _MEANING, columns_csv, paths_csv, trials_csv
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
