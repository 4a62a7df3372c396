import pytest

from sessions.plan import Frame
from sessions.protocols import plan, protocol, protocol_names
from sessions.protocols.protocol import FOLDER
from sessions.toml_file import SettingsError

PAPER = "sensotact-friction"


@pytest.mark.parametrize("name", protocol_names())
def test_every_built_in_protocol_is_named_as_its_file_and_gives_a_plan(name):
    made = plan(protocol(name), "S01", 1)
    assert made.protocol == name
    assert [trial.number for trial in made.trials] == list(range(1, len(made.trials) + 1))


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
    assert all(found == labels[0] for found in labels)
    assert len(set(labels[0].values())) == 10


def test_what_nobody_stated_is_marked_as_default_and_what_was_stated_is_not(tmp_path):
    plain = plan(protocol(PAPER), "S01", 1)
    assert (plain.contact_area, plain.contact_area_origin) == (100.0, "default")
    assert (plain.frame.height_origin, plain.frame.normal_origin) == ("default", "default")
    stated = tmp_path / "ours.toml"
    stated.write_text(
        (FOLDER / f"{PAPER}.toml").read_text()
        + '\n[face]\nheight = 12.5\nheight_origin = "measured"\ncontact_area = 80\nnormal = "+z"\n'
    )
    made = plan(protocol(stated), "S01", 1)
    assert made.frame == Frame("+z", "set", 12.5, "measured")
    assert (made.contact_area, made.contact_area_origin) == (80.0, "set")


def test_a_frame_and_an_area_given_for_the_session_replace_the_protocols():
    made = plan(protocol(PAPER), "S01", 1, frame=Frame(height=20.0, height_origin="set"), contact_area=90.0)
    assert made.frame.height == 20.0
    assert (made.contact_area, made.contact_area_origin) == (90.0, "set")


@pytest.mark.parametrize("subject", ["", "Jane Doe", "../S01", "-S01", "x" * 33, "S\n01"])
def test_a_subject_that_is_no_code_is_refused(subject):
    with pytest.raises(SettingsError, match="never a name"):
        plan(protocol(PAPER), subject, 1)


def test_a_seed_out_of_range_is_refused():
    with pytest.raises(SettingsError, match="2147483647"):
        plan(protocol(PAPER), "S01", -1)


def test_an_unknown_protocol_is_refused_with_the_names_of_those_there_are():
    with pytest.raises(SettingsError, match=PAPER):
        protocol("nothing-like-it")


@pytest.mark.parametrize(
    ("was", "written", "named"),
    [
        ("indentation = 2.0", "indentation = 200.0", r"blocks\[0\].indentation = 200.0 .*up to 10 mm"),
        ("indices = [0, 20, 55, 75, 100]", "indices = [0, 0]", r"blocks\[1\].indices = \[0, 0\] .*twice"),
        ("indices = [0, 20, 55, 75, 100]", "indices = [0, 101]", r"blocks\[1\].indices .*between 0 and 100"),
        ("indices = [0, 20, 55, 75, 100]", "indices = [0, 2.5]", r"blocks\[1\].indices\[1\] = 2.5 .*a whole number"),
        (
            'direction = "distal to proximal"',
            'direction = "down"',
            r'blocks\[1\].direction = "down" .*"proximal to dist',
        ),
        ('order = "shuffled"', 'order = "random"', r'line 6: order = "random" .*"shuffled"'),
        ("contact_angle = 45.0", "contact_angle = 5", r"line 8: contact_angle = 5.0 .*between 10 and 90 degrees"),
        ('name = "slipperiness"', 'name = "stickiness"', r"blocks\[1\].name .*same name"),
        ("label_seed = 1", "label_sed = 1", r"label_sed is not known; allowed here: name, title, order, label_seed"),
    ],
)
def test_a_wrong_protocol_file_is_refused_with_line_key_value_and_what_is_allowed(tmp_path, was, written, named):
    text = (FOLDER / f"{PAPER}.toml").read_text()
    assert was in text
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace(was, written))
    with pytest.raises(SettingsError, match=named) as caught:
        protocol(wrong)
    message = str(caught.value)
    assert message.startswith(f"{wrong}, line ")
    assert "\n" not in message
    line = int(message.removeprefix(f"{wrong}, line ").split(":")[0])
    assert written in wrong.read_text().splitlines()[line - 1]
