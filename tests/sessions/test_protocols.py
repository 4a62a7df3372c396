import re
from collections import Counter
from itertools import pairwise

import pytest
from protocol_texts import OWN

from sessions.plan.plan import Blinded, Finger, Frame
from sessions.plan.protocols.planning import Body, StudyPlace, VisitSetting, plan
from sessions.plan.protocols.protocol import FOLDER, LONGEST_TEXT, Protocol, new_protocol, protocol, protocol_names
from sessions.plan.study import create_study, open_study
from sessions.toml_file import SettingsError, from_toml

PAPER = "sensotact-friction"


def refusal(tmp_path, name, old, new, pattern):
    """Return what a built-in protocol with one text changed is refused with."""
    text = (FOLDER / f"{name}.toml").read_text()
    assert old in text
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace(old, new))
    with pytest.raises(SettingsError, match=pattern) as caught_error:
        protocol(wrong)
    return str(caught_error.value)


@pytest.mark.parametrize("name", protocol_names())
def test_every_built_in_protocol_is_named_as_its_file_and_gives_a_plan(name):
    session_plan = plan(protocol(name), "S01", 1)
    assert session_plan.protocol == name
    assert [trial.number for trial in session_plan.trials] == list(range(1, len(session_plan.trials) + 1))


def test_the_papers_protocol_is_two_blocks_of_five_surfaces_with_their_direction_and_depth():
    sticky, slippery = plan(protocol(PAPER), "S01", 1).blocks
    assert (sticky.direction, sticky.indentation) == (1, 2.0)
    assert sorted(trial.stimulus.index for trial in sticky.trials) == [0, 20, 50, 80, 100]
    assert (slippery.direction, slippery.indentation) == (-1, 1.5)
    assert sorted(trial.stimulus.index for trial in slippery.trials) == [0, 20, 55, 75, 100]
    assert plan(protocol(PAPER), "S01", 1).contact_angle == 45.0


def test_the_same_seed_gives_the_same_plan_and_another_seed_another_order():
    paper = protocol(PAPER)
    assert plan(paper, "S01", 7) == plan(paper, "S01", 7)
    orders = {tuple(trial.stimulus.index for trial in plan(paper, "S01", seed).trials) for seed in range(20)}
    assert len(orders) > 15


def test_a_stimulus_bears_the_same_label_whatever_the_order():
    paper = protocol(PAPER)
    labels = [
        {(t.stimulus.descriptor, t.stimulus.index): t.stimulus.code for t in plan(paper, "S01", seed).trials}
        for seed in range(5)
    ]
    assert all(of_seed == labels[0] for of_seed in labels)
    assert len(set(labels[0].values())) == 10


def test_what_nobody_stated_is_marked_as_default_and_what_was_stated_is_not(tmp_path):
    plain = plan(protocol(PAPER), "S01", 1)
    assert (plain.contact_area, plain.contact_area_origin) == (100.0, "default")
    assert (plain.frame.height_origin, plain.frame.normal_origin) == ("default", "default")
    file = tmp_path / "ours.toml"
    file.write_text(
        (FOLDER / f"{PAPER}.toml").read_text()
        + '\n[face]\nheight = 12.5\nheight_origin = "measured"\ncontact_area = 80\nnormal = "+z"\n'
    )
    session_plan = plan(protocol(file), "S01", 1)
    assert session_plan.frame == Frame("+z", "set", 12.5, "measured")
    assert (session_plan.contact_area, session_plan.contact_area_origin) == (80.0, "set")


def test_a_frame_and_an_area_given_for_the_session_replace_the_protocols():
    setting = VisitSetting(frame=Frame(height=20.0, height_origin="set"), contact_area=90.0)
    session_plan = plan(protocol(PAPER), "S01", 1, setting=setting)
    assert session_plan.frame.height == 20.0
    assert (session_plan.contact_area, session_plan.contact_area_origin) == (90.0, "set")


@pytest.mark.parametrize("subject", ["", "Jane Doe", "../S01", "-S01", "x" * 33, "S\n01"])
def test_a_subject_that_is_no_code_is_refused(subject):
    with pytest.raises(SettingsError, match=r"at most 32.*never a name"):
        plan(protocol(PAPER), subject, 1)


def test_a_seed_out_of_range_is_refused():
    with pytest.raises(SettingsError, match="2147483647"):
        plan(protocol(PAPER), "S01", -1)


def test_an_unknown_protocol_is_refused_with_the_names_of_those_there_are():
    with pytest.raises(SettingsError, match=PAPER):
        protocol("nothing-like-it")


GERMAN = """[[translations]]
language = "de"
block = "softness"
instruction = "Schieben"
question = "Wie weich?"
scale_ends = ["fest", "weich"]
"""


@pytest.mark.parametrize(
    ("short", "key"),
    [
        ("Push your finger once away from you.", "blocks[0].instruction"),
        ("as soft as can be", "blocks[0].scale_ends"),
        ("Schieben", "translations[0].instruction"),
        ("Wie weich?", "translations[0].question"),
    ],
)
def test_a_text_that_no_screen_of_a_subject_holds_is_refused_where_it_is_new_and_read_where_a_study_has_it(
    short, key, tmp_path, monkeypatch
):
    fitting, long = (f"{OWN}{GERMAN}".replace(short, "a" * length) for length in (LONGEST_TEXT, LONGEST_TEXT + 1))
    assert new_protocol(fitting, "own.toml").name == "own"
    refusal = re.escape(f"own.toml: {key} has 1,501 letters, and a subject's screen holds 1,500; shorten it")
    with pytest.raises(SettingsError, match=refusal):
        create_study(tmp_path / "refused", long, 1, blinded=False, source="own.toml")
    monkeypatch.setattr("sessions.plan.study.new_protocol", lambda text, where: from_toml(text, Protocol, where))
    create_study(tmp_path / "former", long, 1, blinded=False)
    assert open_study(tmp_path / "former").protocol.name == "own"


@pytest.mark.parametrize(
    ("old", "new", "pattern"),
    [
        ("indentation = 2.0", "indentation = 200.0", r"blocks\[0\].indentation = 200.0 .*up to 10 mm"),
        ("indices = [0, 20, 55, 75, 100]", "indices = [0, 0]", r"blocks\[1\].indices = \[0, 0\] .*twice"),
        ("indices = [0, 20, 55, 75, 100]", "indices = [0, 101]", r"blocks\[1\].indices .*between 0 and 100"),
        ("indices = [0, 20, 55, 75, 100]", "indices = [0, 2.5]", r"blocks\[1\].indices\[1\] = 2.5 .*a whole number"),
        ('direction = "distal to proximal"', 'direction = "down"', r'blocks\[1\].direction = "down" .*"proximal to d'),
        ('rule = "shuffled"', 'rule = "random"', r'line 12: order.rule = "random" .*"shuffled" or "williams"'),
        ("contact_angle = 45.0", "contact_angle = 5", r"line 7: contact_angle = 5.0 .*between 10 and 90 degrees"),
        ('name = "slipperiness"', 'name = "stickiness"', r"blocks\[1\].name .*same name"),
        ("label_seed = 1", "label_sed = 1", r"label_sed is not known; allowed here: name, title, label_seed"),
        ("strokes_allowed = 1", "strokes_allowed = 0", r"blocks\[0\].strokes_allowed = 0 .*between 1 and 20"),
        ("practice = [0, 100]", "practice = [7]", r"blocks\[0\].practice = \[7\] .*one of indices"),
        ("ticks = 0", "ticks = 200", r"scale.ticks = 200 .*between 0 and 99"),
        ('answer = "line"', 'answer = "colour"', r'scale.answer = "colour" .*"choice" or "line" or "number"'),
        ("not_first = []", "not_first = [0, 20, 50, 55, 75, 80, 100]", r"no order of these meets"),
        ('subject = ["instruction"]', 'subject = ["score"]', r'shown.subject\[0\] = "score" .*"trial count"'),
        ('phases = ["main"]', 'phases = ["warm-up"]', r'phases\[0\] = "warm-up" .*"practice" or "pre-evaluation"'),
        ("# duration = 60 ", "duration = 0.5", r"rests.duration = 0.5 .*between 1 and 3600 s"),
    ],
)
def test_a_wrong_protocol_file_is_refused_with_line_key_value_and_what_is_allowed(tmp_path, old, new, pattern):
    message = refusal(tmp_path, PAPER, old, new, pattern)
    assert message.startswith(f"{tmp_path / 'wrong.toml'}, line ")
    assert "\n" not in message
    if "no order of these" in message:
        return  # the constraint is in one place and the stimuli it shuts out in another
    line = int(message.removeprefix(f"{tmp_path / 'wrong.toml'}, line ").split(":")[0])
    assert new in (tmp_path / "wrong.toml").read_text().splitlines()[line - 1]


@pytest.mark.parametrize(
    ("name", "old", "new", "pattern"),
    [
        (
            "magnitude-estimation",
            'question = "How sticky was it?"',
            "",
            r"blocks\[0\].question = \"\" .*asked",
        ),
        (
            PAPER,
            'scale_ends = ["not sticky at all", "as sticky as can be"]',
            "",
            r"blocks\[0\].scale_ends = nothing .*both",
        ),
        ("paired-comparison", 'answer = "choice"', 'answer = "choice"\nticks = 3', r"scale.ticks = 3 .*only a line"),
        (
            "paired-comparison",
            "[scale]",
            '[order]\nrule = "williams"\n[scale]',
            r'order.rule = "williams" .*"shuffled"',
        ),
        (PAPER, "[pre_evaluation]", "[pre_evaluations]", r"pre_evaluations is not known"),
        ("constant-stimuli", "standard = 50", "standard = 30", r"line 23: blocks\[0\].standard = 30 .*one of indices"),
        (
            "constant-stimuli",
            "repetitions = 10             # of",
            "repetitions = 9 # of",
            r"blocks\[0\].repetitions = 9 .*even",
        ),
        (
            "constant-stimuli",
            "indices = [0, 20, 50, 80, 100]",
            "indices = [0, 50, 100]",
            r"blocks\[0\].indices = .*3 others",
        ),
        ("constant-stimuli", 'answer = "choice"', 'answer = "number"', r"blocks\[0\].standard = 50 .*only a choice"),
        ("adaptive-comparison", "standard = 50\n", "", r"adaptive = 40 .*takes a standard"),
        ("adaptive-comparison", "adaptive = 40", "adaptive = 5", r"adaptive = 5 .*between 10 and 200"),
        (
            "adaptive-comparison",
            "adaptive = 40",
            "adaptive = 40\nrepetitions = 2",
            r"repetitions = 2 .*what its answers ask for",
        ),
    ],
)
def test_what_does_not_go_together_is_refused_with_its_line(tmp_path, name, old, new, pattern):
    assert ", line " in refusal(tmp_path, name, old, new, pattern)


def edit_protocol(tmp_path, *changes, name=PAPER):
    text = (FOLDER / f"{name}.toml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "ours.toml"
    path.write_text(text)
    return protocol(path)


def indices(block):
    return [trial.stimulus.index for trial in block.trials]


def test_pre_evaluation_and_practice_are_blocks_of_their_own_before_what_they_are_for():
    session_plan = plan(protocol(PAPER), "S01", 1, phases=("main", "practice", "pre-evaluation"))
    assert [block.phase for block in session_plan.blocks] == ["pre-evaluation"] * 2 + ["practice", "main"] * 2
    assert [len(block.trials) for block in session_plan.blocks] == [5, 5, 2, 5, 2, 5]
    assert indices(session_plan.blocks[2]) == [0, 100]
    assert all(trial.phase == block.phase for block in session_plan.blocks for trial in block.trials)
    assert [trial.number for trial in session_plan.trials] == list(range(1, 25))
    # The experiment itself is in the order it has without them.
    assert indices(session_plan.blocks[3]) == indices(plan(protocol(PAPER), "S01", 1).blocks[0])


def test_phases_a_protocol_does_not_have_are_refused():
    with pytest.raises(SettingsError, match=r"needs a table \[pre_evaluation\]"):
        plan(protocol("magnitude-estimation"), "S01", 1, phases=("pre-evaluation",))


def test_magnitude_estimation_asks_for_numbers_in_rounds_that_begin_with_different_surfaces():
    for seed in range(30):
        sticky = plan(protocol("magnitude-estimation"), "S01", seed).blocks[0]
        rounds = [indices(sticky)[at : at + 5] for at in (0, 5, 10)]
        assert all(sorted(order) == [0, 20, 50, 80, 100] for order in rounds)
        assert len({order[0] for order in rounds}) == 3
        assert {trial.answer for trial in sticky.trials} == {"number"}
        assert [trial.repetition for trial in sticky.trials if trial.stimulus.index == 50] == [1, 2, 3]


def test_paired_comparison_presents_two_by_two_and_asks_after_the_second():
    session_plan = plan(protocol("paired-comparison"), "S01", 1)
    for block in session_plan.blocks:
        assert len(block.trials) == 20
        for first, second in zip(block.trials[::2], block.trials[1::2], strict=True):
            assert (first.answer, second.answer) == ("none", "choice")
            assert second.compared_with == first.number == second.number - 1
        pairs = {frozenset((a, b)) for a, b in zip(indices(block)[::2], indices(block)[1::2], strict=True)}
        assert len(pairs) == 10


def test_the_same_surfaces_bear_the_same_labels_in_all_built_in_protocols():
    labels = {item for name in protocol_names() for item in protocol(name).labels.items()}
    assert len({stimulus for stimulus, _ in labels}) == len({code for _, code in labels}) == len(labels)


def test_the_rows_of_a_williams_design_are_balanced_over_ten_subjects(tmp_path):
    williams = edit_protocol(tmp_path, ('rule = "shuffled"', 'rule = "williams"'))
    places = [StudyPlace("s", row - 1, row, 5, williams.labels) for row in range(1, 11)]
    plans = [plan(williams, "S01", 1, place=place) for place in places]
    follows = Counter(pair for session_plan in plans for pair in pairwise(indices(session_plan.blocks[1])))
    assert set(follows.values()) == {2}
    assert len(follows) == 20
    assert [session_plan.order_row for session_plan in plans] == list(range(1, 11))
    assert plans[2].order_rule == "williams, row 3 of 10"
    # Another study deals the letters of the design otherwise.
    other_plan = plan(williams, "S01", 1, place=StudyPlace("t", 0, 1, 6, williams.labels))
    assert indices(other_plan.blocks[0]) != indices(plans[0].blocks[0])


def test_constraints_of_the_file_hold_in_every_plan(tmp_path):
    apart = edit_protocol(
        tmp_path, ("neighbours_apart = false", "neighbours_apart = true"), ("not_first = []", "not_first = [100]")
    )
    for seed in range(40):
        for block in plan(apart, "S01", seed).blocks:
            ranks = [sorted(indices(block)).index(index) for index in indices(block)]
            assert all(abs(a - b) > 1 for a, b in pairwise(ranks))
            assert indices(block)[0] != 100


def test_a_subjects_own_finger_angle_and_depths_are_in_the_plan_as_measured():
    body = Body(Finger(tip_radius=6.5, width=17.0), 40.0, {"slipperiness": 1.2})
    session_plan = plan(protocol(PAPER), "S01", 1, body=body)
    assert session_plan.finger == Finger(6.5, 17.0)
    assert (session_plan.contact_angle, session_plan.contact_angle_origin) == (40.0, "measured")
    assert [(b.indentation, b.indentation_origin) for b in session_plan.blocks] == [(2.0, "set"), (1.2, "measured")]


@pytest.mark.parametrize(
    ("body", "pattern"),
    [
        (Body(Finger(tip_radius=50.0)), "tip_radius = 50.0 is not allowed: it must lie between 3 and 15 mm"),
        (Body(contact_angle=120.0), "contact_angle = 120.0 .*90 degrees"),
        (Body(indentations={"sweetness": 1.0}), "no such block; sensotact-friction has stickiness, slipperiness"),
        (Body(indentations={"stickiness": 0.0}), "depth of stickiness = 0.0"),
    ],
)
def test_a_subjects_own_value_out_of_range_is_refused(body, pattern):
    with pytest.raises(SettingsError, match=pattern):
        plan(protocol(PAPER), "S01", 1, body=body)


def test_a_blinded_plan_names_codes_alone():
    paper = protocol(PAPER)
    session_plan = plan(paper, "S01", 1, place=StudyPlace("s", 0, 1, 5, paper.labels, key_sha256="ab"))
    assert session_plan.blinded
    assert {trial.stimulus.index for trial in session_plan.trials} == {None}
    assert [t.stimulus.code for t in session_plan.trials] == [t.stimulus.code for t in plan(paper, "S01", 1).trials]
    with pytest.raises(Blinded, match="unblind"):
        _ = session_plan.trials[0].stimulus.known_index


def counterbalanced(tmp_path, name=PAPER, blocks=2):
    """Return a built-in protocol with its first blocks counterbalanced."""
    head, *tables = (FOLDER / f"{name}.toml").read_text().split("[[blocks]]")
    file = tmp_path / "ours.toml"
    file.write_text(
        "[[blocks]]".join([head.replace("[order]", '[order]\nblocks = "counterbalanced"'), *tables[:blocks]])
    )
    return protocol(file)


def test_counterbalanced_blocks_begin_with_each_block_for_half_of_the_subjects_and_the_plan_says_so(tmp_path):
    ours = counterbalanced(tmp_path)
    places = [StudyPlace("study", slot, 1, 3, ours.labels) for slot in range(4)]
    plans = [plan(ours, "S01", 9, place=place) for place in places]
    assert [[block.name for block in session_plan.blocks] for session_plan in plans] == [
        ["stickiness", "slipperiness"], ["slipperiness", "stickiness"],
    ] * 2  # fmt: skip
    assert [trial.number for trial in plans[1].trials] == list(range(1, 11))
    assert plans[1].order_rule.endswith("blocks counterbalanced, slipperiness first")
    by_seed = {plan(ours, "S01", seed).blocks[0].name for seed in (4, 5)}
    assert by_seed == {"stickiness", "slipperiness"}


def test_within_a_block_the_order_of_surfaces_is_the_same_wherever_the_block_comes(tmp_path):
    ours, as_listed = counterbalanced(tmp_path), protocol(PAPER)
    for name in ("stickiness", "slipperiness"):
        orders = [
            [
                trial.stimulus.index
                for block in plan(document, "S01", 5).blocks
                if block.name == name
                for trial in block.trials
            ]
            for document in (ours, as_listed)
        ]
        assert orders[0] == orders[1]


def test_one_block_alone_cannot_be_counterbalanced(tmp_path):
    with pytest.raises(SettingsError, match="at least two blocks"):
        counterbalanced(tmp_path, "magnitude-estimation", blocks=1)


@pytest.mark.parametrize(
    ("friction", "sentence"), [("[0.3]", "one number for each"), ("[0.3, 0.0]", "between 0.01 and 5")]
)
def test_simulated_friction_has_a_number_for_each_surface(tmp_path, friction, sentence):
    file = tmp_path / "own.toml"
    file.write_text(OWN.replace("[3, 70]", f"[3, 70]\nplanted_friction = {friction}"))
    with pytest.raises(SettingsError, match=sentence):
        protocol(file)


def test_constant_stimuli_meet_every_comparison_with_the_standard_as_often_first_as_second():
    for block, standard in zip(plan(protocol("constant-stimuli"), "S01", 1).blocks, (50, 55), strict=True):
        pair_counts = Counter(zip(indices(block)[::2], indices(block)[1::2], strict=True))
        comparisons = set(indices(block)) - {standard}
        assert pair_counts == {pair: 5 for c in comparisons for pair in ((standard, c), (c, standard))}
        assert {trial.stimulus.index for trial in block.trials if trial.standard} == {standard}
        rounds = [tuple(indices(block)[8 * n : 8 * n + 8]) for n in range(10)]
        assert all(set(stimuli) - {standard} == comparisons for stimuli in rounds)
        assert len(set(rounds)) > 8
