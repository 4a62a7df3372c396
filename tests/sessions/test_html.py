import csv
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from html import escape
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from report_example import TABLES, example

from sessions.exports.figures import plates
from sessions.exports.figures.labels import spread
from sessions.exports.html import ReportError, page, write_figures, write_report

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SVG = "{http://www.w3.org/2000/svg}"


class Words(HTMLParser):
    """The visible words of a page, and every attribute that could fetch something."""

    def __init__(self, text):
        super().__init__()
        self.words, self.fetched, self.tags, self.ids, self._hidden = [], [], [], [], 0
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self._hidden += tag in ("style", "title", "script")
        for name, value in attrs:
            if name in ("src", "srcset", "data", "action", "poster") or name.endswith("href"):
                self.fetched.append(value)
            if name == "id":
                self.ids.append(value)

    def handle_endtag(self, tag):
        self._hidden -= tag in ("style", "title", "script")

    def handle_data(self, data):
        if not self._hidden and data.strip():
            self.words.append(data.strip())


def bare(**changes):
    """A report without pictures, which is quick to write."""
    empty = {
        name: ()
        for name in ("experiments", "strokes", "predictions", "fields", "planted", "flaws", "excluded", "again")
    }
    return example(**{**empty, "course": None, **changes})


@pytest.fixture(scope="module")
def report():
    return example()


@pytest.fixture(scope="module")
def cut():
    """The pictures of `drawn` over whose edge a label goes."""
    return []


@pytest.fixture(scope="module")
def drawn(report, cut):
    save = Figure.savefig

    def looked_at(self, *args, **kwargs):
        self.draw_without_rendering()
        box, drawn = self.bbox_inches, self.get_tightbbox()
        if min(drawn.x0, drawn.y0, box.x1 - drawn.x1, box.y1 - drawn.y1) < 0:
            cut.append([axes.get_ylabel() for axes in self.axes])
        return save(self, *args, **kwargs)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", looked_at)
        return plates(report)


@pytest.fixture(scope="module")
def made(report):
    return page(report)


def test_simulated_is_the_first_thing_a_reader_sees(made):
    assert Words(made).words[0].startswith("SIMULATED")
    assert made.splitlines()[1].startswith("<!-- SIMULATED")
    assert "<title>SIMULATED" in made


def test_a_real_session_says_simulated_nowhere():
    assert "SIMULATED" not in page(example(simulated=False, head="", predictions=(), fields=()))


def test_nothing_on_the_page_is_fetched_from_anywhere(made):
    seen = Words(made)
    assert "script" not in seen.tags
    assert not {"link", "img", "iframe", "object", "embed"} & set(seen.tags)
    assert all(address.startswith("#") for address in seen.fetched)
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", made))
    assert "@import" not in made


def test_every_link_and_clip_of_the_page_leads_to_exactly_one_place(made):
    seen = Words(made)
    assert len(seen.ids) == len(set(seen.ids))
    wanted = {address[1:] for address in seen.fetched} | set(re.findall(r"url\(#([^)]*)\)", made))
    assert wanted <= set(seen.ids)


def test_the_same_report_gives_the_same_bytes(made):
    assert page(example()) == made


def test_every_axis_names_its_unit(drawn):
    for plate in drawn:
        for panel in plate.panels:
            words = ["".join(element.itertext()) for element in ET.fromstring(panel.svg).iter(f"{SVG}text")]
            with_unit = [text for text in words if re.search(r"\[[^\]]+\]", text)]
            assert len(with_unit) >= 2, panel.name


@pytest.mark.usefixtures("drawn")
def test_no_label_of_any_picture_is_cut(cut):
    assert cut == []


def test_hovering_over_a_point_tells_its_values(drawn):
    (panel,) = [p for plate in drawn for p in plate.panels if p.name == "relation-stickiness"]
    titles = [element.text for element in ET.fromstring(panel.svg).iter(f"{SVG}title")]
    assert any("index 100" in title and "9.553 kPa" in title for title in titles)


def test_a_missing_number_is_a_dash_with_its_reason_in_print_too(made):
    cell = re.search(r'<td title="the centre of pressure moves in steps as large as the stroke">–<sup>(\w)</sup>', made)
    assert cell
    assert f"<sup>{cell[1]}</sup> the centre of pressure moves in steps as large as the stroke</li>" in made


def test_words_of_a_session_cannot_become_part_of_the_page():
    text = page(bare(title="<script>alert(1)</script>", excluded=("a < b & c",)))
    assert "<script" not in text
    assert "a &lt; b &amp; c" in text


def test_the_correlation_stands_with_its_interval_and_number_of_stimuli(made, report):
    r = report.experiments[0].score_relation
    assert f"r = +{r.pearson:.2f} (+{r.low:.2f} to" in made
    assert "n = 5" in made
    assert "range of SED: 0.987 kPa" in made  # 9.553 - 8.566


def test_a_report_without_plan_scores_or_predictions_shows_what_it_has():
    strokes = tuple(s for s in example().strokes if s.number < 3)
    bare = example(
        simulated=False,
        head="",
        experiments=(),
        strokes=strokes,
        predictions=(),
        fields=(),
        planted=(),
        modelled=(),
        left_out=(),
    )
    seen = Words(page(bare))
    assert "Forces and friction" in seen.words
    assert not {
        "Scores",
        "Predicted responses",
        "Prediction against score",
        "Planted against recovered friction",
    } & set(seen.words)


def test_a_report_with_nothing_in_it_is_still_a_page():
    assert "No subject, trial, take or stroke was excluded." in Words(page(bare())).words


def test_planted_and_recovered_friction_stand_side_by_side(made):
    table = made[made.index('id="table-planted"') :]
    assert "<td>8.03</td>" in table  # planted tau_max of stickiness 0 [kPa]
    assert "<td>−0.5</td>" in table  # recovered 0.995 of it


def test_writing_replaces_an_older_page_and_leaves_nothing_beside_it(tmp_path):
    path = tmp_path / "deep" / "report.html"
    write_report(bare(title="older"), path)
    write_report(bare(), path)
    assert "older" not in path.read_text(encoding="utf-8")
    assert [file.name for file in path.parent.iterdir()] == ["report.html"]


def test_a_file_that_is_no_report_is_left_alone(tmp_path):
    path = tmp_path / "session.sqlite"
    path.write_bytes(b"SQLite format 3\x00")
    with pytest.raises(ReportError, match="is no report"):
        write_report(bare(), path)
    assert path.read_bytes() == b"SQLite format 3\x00"


def test_a_page_that_cannot_be_written_is_refused_in_one_sentence_and_the_old_one_stays(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    write_report(bare(title="older"), path)

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(ReportError, match=r"cannot be written \(No space left on device\)"):
        write_report(bare(), path)
    assert "older" in path.read_text(encoding="utf-8")
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]


def test_a_place_that_is_no_folder_is_refused_in_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ReportError, match="cannot be"):
        write_report(bare(), tmp_path / "file" / "report.html")


def test_every_picture_is_a_file_with_its_numbers_beside_it(tmp_path, report):
    written = write_figures(report, tmp_path)
    assert {path.suffix for path in written} == {".svg", ".csv"}
    assert {p.stem for p in written if p.suffix == ".svg"} == {p.stem for p in written if p.suffix == ".csv"}
    for path in written:
        text = path.read_text(encoding="utf-8")
        assert "SIMULATED" in text[:200]
        if path.suffix == ".svg":
            assert ET.fromstring(text).tag == f"{SVG}svg"


def test_the_numbers_beside_a_picture_are_those_of_the_report(tmp_path, report):
    write_figures(report, tmp_path)
    lines = (tmp_path / "relation-slipperiness.csv").read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(lines[1:]))
    assert [float(row["SED [MPa]"]) for row in rows] == [row[3] for row in TABLES["slipperiness"].values()]
    friction = (tmp_path / "friction-stickiness.csv").read_text(encoding="utf-8").splitlines()
    first = [row for row in csv.DictReader(friction[1:]) if row["stroke"] == "1"]
    trace = report.strokes[0].trace
    assert [float(row["mu [-]"]) for row in first] == [mu for mu in trace.mu if mu is not None]
    inside = [float(row["time since contact [s]"]) for row in first if row["in steady window"] == "1"]
    assert (min(inside), max(inside)) == (pytest.approx(0.8), pytest.approx(2.0))


@given(
    st.lists(st.floats(-50, 150), max_size=12),
    st.floats(0.1, 8),
)
def test_labels_keep_their_distance_their_order_and_their_place_where_there_is_room(wanted, gap):
    placed = spread(wanted, gap, 0.0, 100.0)
    by_wish = [place for _, place in sorted(zip(wanted, placed, strict=True), key=lambda pair: pair[0])]
    assert all(b - a >= gap * (1 - 1e-9) for a, b in zip(sorted(placed), sorted(placed)[1:], strict=False))
    assert by_wish == sorted(by_wish) or len(set(wanted)) < len(wanted)
    if len(wanted) * gap < 100:
        assert all(-1e-6 <= place <= 100 + 1e-6 for place in placed)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to open the page in")
@pytest.mark.parametrize("width", [360, 1280])
def test_the_page_is_no_wider_than_its_window(tmp_path, made, width):
    frame = f'<iframe style="width: {width}px; border: 0" srcdoc="{escape(made)}"></iframe>'
    measure = (
        "<script>onload = () => { const page = document.querySelector('iframe').contentDocument.documentElement;"
        "document.title = `width ${page.clientWidth} ${page.scrollWidth}` }</script>"
    )
    (tmp_path / "page.html").write_text(f"<title></title>{frame}{measure}", encoding="utf-8")
    shown = subprocess.run(
        [
            CHROMIUM,
            *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
            f"--user-data-dir={tmp_path / 'profile'}",
            "--window-size=1400,900",
            "--dump-dom",
            (tmp_path / "page.html").as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    ).stdout
    inside, needed = map(int, re.search(r"<title>width (\d+) (\d+)", shown).groups())
    assert needed <= inside <= width
