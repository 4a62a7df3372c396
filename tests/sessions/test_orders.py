import hashlib
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.orders import opaque_codes, shuffled

STIMULI = (0, 20, 50, 80, 100)


@given(seed=st.integers(0, 2**31 - 1), name=st.text(max_size=8))
def test_a_shuffled_order_holds_every_stimulus_once(seed, name):
    assert sorted(shuffled(STIMULI, seed, name)) == list(STIMULI)


@given(seed=st.integers(0, 2**31 - 1), given=st.permutations(STIMULI))
def test_the_order_depends_on_seed_and_name_alone_not_on_how_the_stimuli_were_listed(seed, given):
    assert shuffled(given, seed, "stickiness") == shuffled(STIMULI, seed, "stickiness")


def test_blocks_of_one_session_are_shuffled_apart():
    assert len({shuffled(STIMULI, 1, name) for name in ("stickiness", "slipperiness", "roughness")}) > 1


def test_an_order_follows_the_rule_that_the_docs_state():
    by_hand = sorted(STIMULI, key=lambda item: hashlib.sha256(f"42/stickiness/{item}".encode()).hexdigest())
    assert list(shuffled(STIMULI, 42, "stickiness")) == by_hand


def test_every_stimulus_comes_first_about_equally_often_over_seeds():
    first = Counter(shuffled(STIMULI, seed, "stickiness")[0] for seed in range(2000))
    # 400 expected of each; the standard deviation of a binomial count is 18.
    assert all(abs(count - 400) < 90 for count in first.values())


@given(count=st.integers(0, 60), seed=st.integers(0, 2**31 - 1))
def test_labels_differ_and_are_a_consonant_and_two_digits(count, seed):
    codes = opaque_codes(count, seed)
    assert len(set(codes)) == count
    assert all(code[0] in "BCDFGHJKLMNPQRSTVWXZ" and code[1:].isdigit() and len(code) == 3 for code in codes)


def test_a_label_once_given_stays_when_more_are_asked_for():
    assert opaque_codes(20, 3)[:10] == opaque_codes(10, 3)


def test_more_labels_than_there_are_is_refused():
    with pytest.raises(ValueError, match="at most 2000"):
        opaque_codes(2001, 1)
