"""Rivals of a model's quantity: what else follows the scores, compared as published methods compare it."""

import math
from dataclasses import asdict, replace

import numpy as np
import pytest
from report_example import TABLES, example
from study_example import study

from sessions.report.figures import picture
from sessions.report.pages import rivals_csv, study_page
from sessions.report.prose import distinctions
from sessions.report.tables.rivals import rivals_sentences
from sessions.report.tables.session import tables
from sessions.statistics.correlations import (
    Contrast,
    required_cases,
)
from sessions.statistics.rivals import (
    MODEL_MU,
    MODEL_SED,
    STROKE_FIELDS,
    Rival,
    RivalTrial,
    rivals_of_means,
    rivals_within,
)
from sessions.statistics.within_subjects import repeated_correlation
from solver import Finger, solve_many
from solver.scene.published import scenes as published_scenes


@pytest.mark.parametrize(
    ("descriptor", "mu", "tau_max"),
    [("stickiness", 0.974, 0.954), ("slipperiness", -0.860, -0.979)],
)
def test_friction_follows_the_published_indices_as_closely_as_the_sed_does(descriptor, mu, tau_max):
    rivals = {rival.name: rival for rival in published(descriptor)}
    assert rivals[MODEL_MU].r == pytest.approx(mu, abs=5e-4)
    assert rivals["τ max"].r == pytest.approx(tau_max, abs=5e-4)
    assert rivals[MODEL_MU].same_order
    assert rivals["τ max"].same_order is (descriptor == "stickiness")
    assert rivals[MODEL_MU].contrast.low < 0.0 < rivals[MODEL_MU].contrast.high
    assert rivals[MODEL_MU].needed > 5


def published(descriptor):
    """Return how the numbers of the published tables go with the index of each surface."""
    rows = TABLES[descriptor]
    names = (MODEL_MU, "τ max", "speed", MODEL_SED)
    series = {name: {index: row[at] for index, row in rows.items()} for at, name in enumerate(names)}
    return rivals_of_means({index: float(index) for index in rows}, series)


@pytest.mark.parametrize(("radius", "sticky", "slippery"), [(5.0, 1, -1), (7.0, -1, 1)])
def test_a_tip_of_seven_millimetres_turns_the_published_signs_round(radius, sticky, slippery):
    ten = [replace(scene, finger=Finger(tip_radius=radius)) for scene in published_scenes()]
    seds = [answer.sed_ending for answer in solve_many(ten)]
    series = zip(TABLES.values(), (seds[:5], seds[5:]), strict=True)
    signs = [np.sign(np.corrcoef(list(rows), values)[0, 1]) for rows, values in series]
    assert signs == [sticky, slippery]


def test_scores_that_no_subject_varies_are_compared_with_nothing_and_the_reason_is_said():
    trials = [
        RivalTrial(subject, index, level, {MODEL_SED: mu**2, MODEL_MU: mu, "N": 1.0 + 0.1 * mu + level / 50.0 * mu**3})
        for subject, level in (("a", 20.1), ("b", 50.3), ("c", 80.7))
        for index, mu in zip((0, 20, 50, 80, 100), (0.28, 0.44, 0.48, 0.64, 0.67), strict=True)
    ]
    difference = rivals_within(trials)
    assert all(name.r is None and name.contrast is None and name.partial is None for name in difference)
    (sentence,) = rivals_sentences("stickiness", difference)
    assert sentence == "Of stickiness, the SED is compared with no rival: one of them does not vary within subjects."


def test_what_has_no_number_has_a_reason_instead():
    series = {
        MODEL_SED: {0: 1.0, 1: 2.0, 2: 4.0, 3: 3.0},
        "µ static": {0: 1.0},
        MODEL_MU: {0: 1.0, 1: 2.0, 2: 4.0, 3: 3.0},
    }
    rivals = {rival.name: rival for rival in rivals_of_means({0: 1.0, 1: 3.0, 2: 4.0, 3: 2.0}, series)}
    assert rivals["µ static"].r is None
    assert set(rivals["µ static"].reasons) == {"r", "contrast", "partial", "left_out_error"}
    assert "µ determines it" in rivals[MODEL_SED].reasons["partial"]
    assert rivals[MODEL_MU].contrast is None  # the two are one variable
    assert rivals_of_means({0: 1.0}, {MODEL_MU: {0: 1.0}}) == ()


def test_only_rivals_of_all_the_surfaces_are_said_to_order_them_as_the_model_does():
    """At finite strain two of five surfaces have no SED, and two of its three a static peak too."""
    mu = {0: 0.2, 20: 0.3, 50: 0.45, 80: 0.5, 100: 0.7}
    sed = {0: 1.0, 20: 2.0, 50: 4.0, 80: 4.5}
    static = {index: 1.2 * mu[index] for index in (0, 20, 80, 100)}
    scores = {0: 5.0, 20: 30.0, 50: 44.0, 80: 81.0, 100: 90.0}
    rivals = rivals_of_means(scores, {MODEL_SED: sed, MODEL_MU: mu, "µ static": static})
    order, _ = rivals_sentences("stickiness", rivals)
    assert order.startswith("Stickiness: µ of the model orders these 4 surfaces as the SED does, so")
    assert "static" not in order


def test_three_surfaces_have_no_test_and_so_no_number_of_surfaces_that_a_test_needs():
    sed, mu = {0: 1.0, 50: 4.0, 100: 6.0}, {0: 0.2, 50: 0.3, 100: 0.7}
    rivals = rivals_of_means({0: 5.0, 50: 50.0, 100: 80.0}, {MODEL_SED: sed, MODEL_MU: mu})
    assert rivals[-1].needed is None
    assert rivals_sentences("stickiness", rivals)[0] == (
        "Stickiness: µ of the model orders these 3 surfaces as the SED does, so no order of scores can distinguish it "
        "from it."
    )


def test_a_single_rival_is_one_rival():
    contrast_of_one = Contrast(5, 0.9, 0.5, 1.2, 3.0, 0.003)
    rivals = (Rival(MODEL_SED, 5, 0.9, None, None), Rival("N", 5, 0.0, None, None, contrast_of_one))
    assert rivals_sentences("stickiness", rivals)[-1].endswith("(p < 0.05 by Holm over 1 rival).")


def people(draw, judge, subjects=10):
    """Return trials of people who judge five surfaces by `judge(µ, SED)`; the SED bends against µ."""
    trials = []
    for subject in range(subjects):
        level = draw.normal(50.0, 8.0)
        for index, mu in zip((0, 20, 50, 80, 100), (0.28, 0.44, 0.48, 0.64, 0.67), strict=True):
            own = mu * math.exp(draw.normal(0.0, 0.12))
            sed = 0.0086 + 0.002 * (own - 0.5) ** 2 + 0.001 * draw.normal(0.0, 0.3)
            score = level + judge(own, sed) + draw.normal(0.0, 4.0)
            trials.append(
                RivalTrial(f"S{subject}", index, score, {MODEL_SED: sed, MODEL_MU: own, "N": draw.normal(1.0, 0.1)})
            )
    return trials


def test_the_quantity_that_people_judge_by_is_distinguished_from_its_rivals():
    draw = np.random.default_rng(7)
    by_mu = {rival.name: rival for rival in rivals_within(people(draw, lambda mu, _: 120.0 * (mu - 0.5)))}
    by_sed = {rival.name: rival for rival in rivals_within(people(draw, lambda _, sed: 4e4 * (sed - 0.0086)))}
    assert by_mu[MODEL_MU].contrast.high < 0.0 < by_sed[MODEL_MU].contrast.low
    assert by_mu[MODEL_SED].partial_low < 0.0 < by_mu[MODEL_SED].partial_high
    assert by_sed[MODEL_SED].partial_low > 0.5
    assert by_mu[MODEL_MU].weight > 0.95
    assert by_sed[MODEL_SED].weight > 0.95
    assert by_mu[MODEL_MU].left_out_error < by_mu[MODEL_SED].left_out_error
    assert sum(rival.weight for rival in by_mu.values()) == pytest.approx(1.0)


def test_numbers_within_subjects_are_those_of_trials_without_each_subjects_mean():
    trials = people(np.random.default_rng(8), lambda mu, _: 90.0 * mu, subjects=4)
    rivals = {rival.name: rival for rival in rivals_within(trials)}
    who = [trial.subject for trial in trials]
    columns = {name: np.array([trial.values[name] for trial in trials]) for name in (MODEL_SED, MODEL_MU)}
    columns["score"] = np.array([trial.score for trial in trials])
    centred = {
        name: (v.reshape(4, 5) - v.reshape(4, 5).mean(axis=1, keepdims=True)).ravel() for name, v in columns.items()
    }
    expected = repeated_correlation(who, columns[MODEL_SED], columns["score"])
    assert (rivals[MODEL_SED].r, rivals[MODEL_SED].low) == (expected.r, expected.people[0])
    steps = [abs(np.corrcoef(centred["score"], centred[name])[0, 1]) for name in (MODEL_SED, MODEL_MU)]
    assert rivals[MODEL_MU].contrast.difference == pytest.approx(steps[0] - steps[1])
    leftover = [
        centred[name]
        - centred[MODEL_MU] * (centred[name] @ centred[MODEL_MU]) / (centred[MODEL_MU] @ centred[MODEL_MU])
        for name in (MODEL_SED, "score")
    ]
    assert rivals[MODEL_SED].partial == pytest.approx(np.corrcoef(leftover)[0, 1])


def test_intervals_over_four_subjects_hold_the_differences_of_very_many(monkeypatch):
    """r of 200,000 subjects is the truth."""
    monkeypatch.setattr(
        "sessions.statistics.rivals.crossed_aic", lambda *_: None
    )  # of the weights, which nothing here asks for
    draw = np.random.default_rng(31)

    def cases(people):
        base = np.linspace(-2.0, 2.0, 5)
        model = base + 0.5 * draw.standard_normal((people, 5))
        rival, mu = (share * base + 0.9 * draw.standard_normal((people, 5)) for share in (0.6, 0.8))
        level, slope = draw.normal((50.0, 8.0), (10.0, 3.0), (people, 2)).T[:, :, None]
        return level + slope * model + 8.0 * draw.standard_normal((people, 5)), model, rival, mu

    scores, *values = (column - column.mean(axis=1, keepdims=True) for column in cases(200_000))
    r = np.corrcoef([column.ravel() for column in (scores, *values)])
    partial = (r[0, 1] - r[0, 3] * r[1, 3]) / math.sqrt((1 - r[0, 3] ** 2) * (1 - r[1, 3] ** 2))
    coverage = []
    for _ in range(100):
        score, *columns = cases(4)
        trials = [
            RivalTrial(
                str(i),
                j,
                score[i, j],
                {MODEL_SED: columns[0][i, j], "N": columns[1][i, j], MODEL_MU: columns[2][i, j]},
            )
            for i in range(4)
            for j in range(5)
        ]
        rivals = {name.name: name for name in rivals_within(trials)}
        step, partial_model = rivals["N"].contrast, rivals[MODEL_SED]
        holds = step.low <= r[0, 1] - r[0, 2] <= step.high
        coverage.append((holds, partial_model.partial_low <= partial <= partial_model.partial_high))
    assert (np.mean(coverage, axis=0) >= 0.90).all()  # two standard errors of 100 below 95 %


def test_a_quantity_that_trials_lack_gets_no_weight_and_the_others_keep_theirs():
    trials = people(np.random.default_rng(9), lambda mu, _: 90.0 * mu)
    some = [
        RivalTrial(t.subject, t.index, t.score, {k: v for k, v in t.values.items() if k != "N" or t.index})
        for t in trials
    ]
    complete = {rival.name: rival for rival in rivals_within([t for t in trials if t.values])}
    rivals = {rival.name: rival for rival in rivals_within(some)}
    assert rivals["N"].weight is None
    assert "10 of 50 trials" in rivals["N"].reasons["weight"]
    ratio = rivals[MODEL_SED].weight / rivals[MODEL_MU].weight
    assert ratio == pytest.approx(complete[MODEL_SED].weight / complete[MODEL_MU].weight)


def test_a_session_shows_every_rival_beside_the_sed_in_table_picture_data_and_summary():
    report = example()
    rivals_table = next(table for table in tables(report)["rivals"] if table.name == "table-rivals")
    assert [row[0].text for row in rivals_table.groups[0].rows] == [MODEL_SED, *STROKE_FIELDS]
    assert len(rivals_table.caption.split()) <= 60
    picture_text = picture(report, "relation", "stickiness").svg.replace("\N{NO-BREAK SPACE}", " ")
    assert "τ max +0.95" in picture_text
    rivals = report.experiments[0].rivals
    at = [rival.name for rival in rivals].index(MODEL_MU)
    assert asdict(report)["experiments"][0]["rivals"][at]["contrast"]["z"] == rivals[at].contrast.z
    sentences = " ".join(distinctions(report))
    assert "µ of the model and τ max order these 5 surfaces as the SED does, so no order of scores" in sentences
    cases = required_cases(*correlations_of(report.experiments[0]))
    assert f"{float(f'{cases:.2g}'):.0f} (µ of the model)" in sentences


def correlations_of(experiment):
    """Return r of SED and of µ with the mean scores, and with each other, of the made-up report."""
    rows = TABLES[experiment.descriptor]
    (_, a, b), (_, _, c), _ = np.corrcoef(
        [[m.mean for m in experiment.scores], [row[3] for row in rows.values()], [row[0] for row in rows.values()]]
    )
    return a, b, c


def test_a_study_shows_rivals_of_means_and_within_subjects_on_its_page_and_as_csv(monkeypatch):
    monkeypatch.setattr("sessions.report.pages.study_plates", lambda _: ())  # the words of the page alone
    findings = study()
    page = study_page(findings, "x")
    assert 'id="table-rivals"' in page
    assert "stickiness, within subjects" in page
    rows = rivals_csv(findings).splitlines()
    assert rows[0].startswith("SIMULATED,descriptor,kind,name,n,r,low,high")
    assert sum(",within," in row for row in rows) == len(findings.descriptors[0].rivals)


def test_a_sentence_names_those_rivals_whose_p_allows_for_all_of_them():
    """Holm's p of 0.01, 0.03 and 0.04 are 0.03, 0.06 and 0.06."""
    steps = {"N": (0.5, 0.01), "T": (-0.3, 0.03), "speed": (0.4, 0.04)}
    rivals = [
        Rival(name, 50, 0.5, 0.1, 0.8, Contrast(50, step, None, None, None, p)) for name, (step, p) in steps.items()
    ]
    (sentence,) = rivals_sentences("roughness", [Rival(MODEL_SED, 50, 0.9, 0.8, 0.95), *rivals])
    assert sentence == (
        "On roughness, the scores follow N less closely than the SED (p < 0.05 by Holm over 3 rivals); they "
        "distinguish the SED from none of these: T and speed."
    )


def test_equal_rivals_are_said_to_be_told_apart_by_no_number_of_surfaces():
    score = {0: 1.0, 1: 3.0, 2: 4.0, 3: 2.0, 4: 6.0}
    same = {0: 1.0, 1: 2.0, 2: 4.0, 3: 3.0, 4: 5.0}
    twice = {index: 2.0 * value for index, value in same.items()}
    sentences = rivals_sentences("roughness", rivals_of_means(score, {MODEL_SED: same, MODEL_MU: twice}))
    assert sentences[0].startswith("Roughness: µ of the model orders these 5 surfaces as the SED does")
    assert sentences[0].endswith("no number of surfaces would.")
