"""The simulated subject: a hand and a judge."""

import numpy as np
import pytest
from scipy import stats

from simulators.stroke import Course, paper_surfaces
from simulators.subject import SimulatedSubject, SubjectSettings

SURFACES = paper_surfaces()


@pytest.mark.parametrize("seed", range(0, 50, 10))
def test_a_subject_scores_and_strokes_alike_whatever_the_order(seed):
    forwards = {key: SimulatedSubject(seed).score(s) for key, s in SURFACES.items()}
    subject = SimulatedSubject(seed)
    backwards = {key: subject.score(s) for key, s in reversed(SURFACES.items())}
    assert forwards == backwards
    surface = SURFACES["stickiness", 20]
    assert subject.stroke(surface) == SimulatedSubject(seed).stroke(surface)
    assert subject.stroke(surface) != subject.stroke(surface, repetition=2)
    assert subject.stroke(surface) != SimulatedSubject(seed + 1).stroke(surface)


def test_scores_are_tenths_on_the_line():
    for seed in range(100):
        for surface in SURFACES.values():
            score = SimulatedSubject(seed).score(surface)
            assert 0.0 <= score <= 100.0
            assert score == round(score, 1)


@pytest.mark.parametrize("first", range(0, 60, 10))
def test_ten_subjects_score_near_the_makers_index_and_differ(first):
    for (_, index), surface in SURFACES.items():
        scores = [SimulatedSubject(seed).score(surface) for seed in range(first, first + 10)]
        assert np.mean(scores) == pytest.approx(index, abs=9.0)
        assert len(set(scores)) > 3


def test_a_judge_that_follows_friction_alone_puts_slippery_55_below_75_upside_down():
    settings = SubjectSettings(judgement_noise=0.0, friction_weight=1.0)
    subject = SimulatedSubject(1, settings)
    assert subject.score(SURFACES["slipperiness", 55]) > subject.score(SURFACES["slipperiness", 75])
    assert subject.score(SURFACES["stickiness", 100]) > subject.score(SURFACES["stickiness", 0])


def test_every_stroke_is_one_a_hand_can_do():
    for seed in range(100):
        for surface in SURFACES.values():
            stroke = SimulatedSubject(seed).stroke(surface)
            course = Course(stroke, surface.mu, surface.holds)
            assert stroke.approach >= 0.5
            assert 1.5 < course.lift - course.touch < 4.0
            assert stroke.peak_normal_force == surface.peak_normal_force
            assert stroke.direction == surface.direction


def test_choices_by_friction_follow_a_cumulative_normal_law_of_log_friction_with_lapses():
    settings = SubjectSettings(discrimination=0.2, lapse=0.1)
    first, second = SURFACES["stickiness", 20], SURFACES["stickiness", 50]
    share = np.mean([SimulatedSubject(n, settings).more_friction(first, second, 1) for n in range(4000)])
    expected = 0.05 + 0.9 * stats.norm.cdf(np.log(0.44 / 0.48) / 0.2)
    assert share == pytest.approx(expected, abs=4.0 * np.sqrt(expected * (1.0 - expected) / 4000))
    answers = [SimulatedSubject(1, settings).more_friction(first, second, trial) for trial in range(50)]
    assert len(set(answers)) == 2  # each trial is judged anew
