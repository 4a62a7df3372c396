import base64
import csv
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser
from unittest.mock import patch

import numpy as np
import pytest
from browser import CHROMIUM, FLAGS, PAPER_HEIGHT, open_page
from matplotlib.figure import Figure
from page_numbers import estimates
from report_example import TABLES, bare, example, short
from study_example import study

from sessions.report.figures import plates
from sessions.report.pages import page, study_page, write_figures
from sessions.report.study_prose import remarks
from sessions.report.tables.session import tables

PDFTOTEXT = shutil.which("pdftotext")
SVG = "{http://www.w3.org/2000/svg}"
FETCHES = ("src", "srcset", "data", "action", "poster")  # attributes that could fetch something


class Words(HTMLParser):
    """The visible words of a page, and every attribute that could fetch something."""

    def __init__(self, text):
        super().__init__()
        self.words, self.addresses, self.tags, self.ids, self._hidden = [], [], [], [], 0
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self._hidden += tag in ("style", "title", "script")
        self.ids += [value for name, value in attrs if name == "id"]
        self.addresses += [value for name, value in attrs if name in FETCHES or name.endswith("href")]

    def handle_endtag(self, tag):
        self._hidden -= tag in ("style", "title", "script")

    def handle_data(self, data):
        if not self._hidden and data.strip():
            self.words.append(data.strip())


@pytest.fixture(scope="module")
def report():
    return example()


@pytest.fixture(scope="module")
def drawing(report):
    """Return the pictures, drawn once for all tests, and the axes of which a label is cut."""
    labels, save = [], Figure.savefig

    def save_checked(self, *args, **kwargs):
        save(self, *args, **kwargs)
        box, extent = self.bbox_inches, self.get_tightbbox()
        if min(extent.x0, extent.y0, box.x1 - extent.x1, box.y1 - extent.y1) < 0:
            labels.append([axes.get_ylabel() for axes in self.axes])

    with patch.object(Figure, "savefig", save_checked):
        return plates(report), labels


@pytest.fixture(scope="module")
def pictures(drawing):
    return drawing[0]


@pytest.fixture
def reuse_pictures(pictures, monkeypatch):
    """Let nothing be drawn anew."""
    monkeypatch.setattr("sessions.report.pages.plates", lambda _: pictures)


@pytest.fixture(scope="module")
def page_text(report, pictures):
    with patch("sessions.report.pages.plates", lambda _: pictures):  # drawn once for all
        return page(report)


def test_simulated_is_the_first_thing_a_reader_sees(page_text):
    assert Words(page_text).words[0].startswith("SIMULATED")
    assert page_text.splitlines()[1].startswith("<!-- SIMULATED")
    assert "<title>SIMULATED" in page_text


def test_a_real_session_says_simulated_nowhere():
    real = example(head="", predictions=(), fields=(), strokes=example().strokes[:1])
    assert "SIMULATED" not in page(real)


def test_nothing_on_the_page_is_fetched_from_anywhere(page_text):
    words = Words(page_text)
    assert "script" not in words.tags
    assert not {"link", "img", "iframe", "object", "embed"} & set(words.tags)
    assert all(address.startswith(("#", "data:text/csv;")) for address in words.addresses)
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", page_text))
    assert "@import" not in page_text


def test_every_link_and_clip_of_the_page_leads_to_exactly_one_place(page_text):
    words = Words(page_text)
    assert len(words.ids) == len(set(words.ids))
    targets = {address[1:] for address in words.addresses if address[0] == "#"}
    assert targets | set(re.findall(r"url\(#([^)]*)\)", page_text)) <= set(words.ids)


def test_the_same_report_gives_the_same_bytes():
    assert page(short()) == page(short())


@pytest.mark.slow
def test_the_same_whole_report_gives_the_same_bytes(page_text):
    assert page(example()) == page_text


def test_every_axis_names_its_unit(pictures):
    for plate in pictures:
        for panel in plate.panels:
            words = ["".join(element.itertext()) for element in ET.fromstring(panel.svg).iter(f"{SVG}text")]
            with_unit = [text for text in words if re.search(r"\[[^\]]+\]", text)]
            assert len(with_unit) >= 2, panel.name


def test_no_label_of_any_picture_is_cut(drawing):
    assert drawing[1] == []


def test_hovering_over_a_point_tells_its_values(pictures):
    (panel,) = [p for plate in pictures for p in plate.panels if p.name == "relation-stickiness"]
    titles = [element.text for element in ET.fromstring(panel.svg).iter(f"{SVG}title")]
    assert any("index 100" in title and "9.553 kPa" in title for title in titles)


def test_a_missing_number_is_a_dash_with_its_reason_in_print_too(page_text):
    cell = re.search(
        r'<td title="the centre of pressure moves in steps as large as the stroke">–<sup>(\w)</sup>', page_text
    )
    assert cell
    assert f"<sup>{cell[1]}</sup> the centre of pressure moves in steps as large as the stroke</li>" in page_text


def test_words_of_a_session_cannot_become_part_of_the_page():
    text = page(bare(title="<script>alert(1)</script>", excluded=("a < b & c",)))
    assert "<script" not in text
    assert "a &lt; b &amp; c" in text


def test_the_correlation_stands_with_its_interval_and_number_of_stimuli(page_text, report):
    r = report.experiments[0].score_relation
    assert f"r = +{r.pearson:.2f} (+{r.low:.2f} to" in page_text
    assert "n = 5" in page_text
    assert "range of SED: 0.987 kPa" in page_text  # 9.553 - 8.566


def test_a_report_without_plan_scores_or_predictions_shows_what_it_has():
    strokes = tuple(s for s in example().strokes if s.number < 3)
    small_report = example(
        head="",
        experiments=(),
        strokes=strokes,
        predictions=(),
        fields=(),
        ground_truth=(),
        modelled=(),
        left_out=(),
    )
    html = page(small_report)
    words = Words(html).words
    assert "Friction" in words
    assert not {"Scores", "Predicted responses", "Prediction against score"} & set(words)
    assert 'id="table-planted"' not in html


def test_a_report_with_nothing_in_it_is_still_a_page():
    assert "No subject, trial, take or stroke was excluded." in Words(page(bare())).words


def test_every_table_that_tells_an_sed_names_the_model_it_is_of(report):
    sed_tables = [table for g in tables(report).values() for table in g if any("SED" in c.name for c in table.columns)]
    assert "table-afferent" in {table.name for table in sed_tables}
    assert [table.name for table in sed_tables if report.model not in table.caption] == []


def test_true_and_estimated_friction_stand_side_by_side(page_text):
    table = page_text[page_text.index('id="table-planted"') :]
    assert "<td>8.03</td>" in table  # true tau_max of stickiness 0 [kPa]
    assert "<td>−0.5</td>" in table  # estimated as 0.995 of it


@pytest.mark.usefixtures("reuse_pictures")
def test_every_picture_is_a_file_with_its_numbers_beside_it(tmp_path, report):
    paths = write_figures(report, tmp_path)
    assert {path.suffix for path in paths} == {".svg", ".csv"}
    assert {p.stem for p in paths if p.suffix == ".svg"} == {p.stem for p in paths if p.suffix == ".csv"}
    for path in paths:
        text = path.read_text(encoding="utf-8")
        assert "SIMULATED" in text[:200]
        if path.suffix == ".svg":
            assert ET.fromstring(text).tag == f"{SVG}svg"


@pytest.mark.usefixtures("reuse_pictures")
def test_the_numbers_beside_a_picture_are_those_of_the_report(tmp_path, report):
    write_figures(report, tmp_path)
    lines = (tmp_path / "relation-slipperiness.csv").read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(lines[1:]))
    assert [float(row["SED [MPa]"]) for row in rows] == [row[3] for row in TABLES["slipperiness"].values()]
    friction = (tmp_path / "friction-stickiness.csv").read_text(encoding="utf-8").splitlines()
    first = [row for row in csv.DictReader(friction[1:]) if row["stroke"] == "1"]
    trace = report.strokes[0].trace
    assert [float(row["mu [-]"]) for row in first] == trace.mu[~np.isnan(trace.mu)].tolist()
    inside = [float(row["time since contact [s]"]) for row in first if row["in steady window"] == "1"]
    assert (min(inside), max(inside)) == (pytest.approx(0.8), pytest.approx(2.0))


@pytest.mark.usefixtures("reuse_pictures")
@pytest.mark.parametrize(
    ("name", "column", "values"), [("normal-force", "N [N]", "normal"), ("tangential-force", "T [N]", "tangential")]
)
def test_forces_of_a_series_lie_over_each_other_stroke_by_stroke(tmp_path, report, name, column, values):
    write_figures(report, tmp_path)
    lines = (tmp_path / f"{name}-slipperiness.csv").read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(lines[1:]))
    strokes = [stroke for stroke in report.strokes if stroke.experiment == "slipperiness"]
    assert {row["stroke"] for row in rows} == {str(stroke.number) for stroke in strokes}
    for stroke in strokes:
        forces = [float(row[column]) for row in rows if row["stroke"] == str(stroke.number)]
        assert forces == list(getattr(stroke.trace, values))


def test_the_numbers_of_a_picture_are_on_the_page_itself(page_text, pictures):
    (panel,) = [p for plate in pictures for p in plate.panels if p.name == "relation-stickiness"]
    link = re.search(r'download="relation-stickiness.csv" href="data:text/csv;charset=utf-8;base64,([^"]*)"', page_text)
    rows = list(csv.reader(base64.b64decode(link[1]).decode().splitlines()))
    assert rows[0][0].startswith("# SIMULATED")
    assert rows[2:] == [["" if value is None else str(value) for value in row] for row in panel.rows]


@pytest.fixture(scope="module")
def pooled_study():
    return study()


@pytest.fixture(scope="module", params=["session", "study"])
def text(request, page_text, pooled_study):
    return page_text if request.param == "session" else study_page(pooled_study, "example")


def test_a_study_solved_on_several_meshes_says_so_and_what_it_makes_of_the_seds(pooled_study):
    findings = pooled_study
    assert not any("meshes" in sentence for sentence in remarks(findings))
    model = [(("unknowns", f"{4212 * (1 + n % 2)} displacements", ""),) for n in range(len(findings.visits))]
    visits = tuple(replace(visit, model=m) for visit, m in zip(findings.visits, model, strict=True))
    (remark,) = [sentence for sentence in remarks(replace(findings, visits=visits)) if "meshes" in sentence]
    assert "2 finenesses (4212 displacements: S01" in remark
    assert "0.20 to 0.20 % of it" in remark  # the estimated error of every SED of the example


def test_every_number_of_a_table_has_a_unit_and_an_interval_or_says_why_it_has_none(text):
    numbers = list(estimates(text))
    assert [place for place, unit, _, _ in numbers if not unit] == []
    assert [place for place, _, interval, why in numbers if not interval and not why] == []
    without = [(place, why) for place, _, interval, why in numbers if not interval]
    assert {place for place, why in without if why != "no interval of a perfect rho" and ", 7 " not in place} == set()
    assert len(without) < 0.1 * len(numbers)  # those of the one stroke with too few readings, the seventh
    assert sum(bool(interval) for _, _, interval, _ in numbers) > 100


def test_a_state_that_no_finger_can_be_in_has_numbers_without_an_error_or_an_interval(report):
    doubt = "Tissue is turned inside out somewhere."
    prediction = report.predictions[0]
    inverted = replace(
        prediction,
        doubt=doubt,
        opposite_doubt=doubt,
        alternatives=tuple(replace(other, doubt=doubt) for other in prediction.alternatives),
    )
    prediction_tables = tables(replace(report, predictions=(inverted,)))["predictions"]
    cells = [cell for table in prediction_tables for group in table.groups for row in group.rows for cell in row]
    marks = {mark for table in prediction_tables for mark, sentence in table.notes if doubt in sentence}
    doubtful = [cell for cell in cells if set(cell.mark.split(",")) & marks]
    assert len(doubtful) > 8
    assert not any("±" in cell.text or cell.interval for cell in doubtful)
    assert not any(
        "±" in cell.text
        for table in prediction_tables
        if table.name != "table-forces"
        for group in table.groups
        for row in group.rows
        for cell in row
    )


_CAPTIONS = r'<(?:fig)?caption>(.*?)(?:<span class="screen">|</caption>)'


def test_the_body_has_at_most_five_tables_with_captions_of_at_most_sixty_words_and_an_appendix(text):
    body, appendix = re.split(r'<h2 id="further">', text)
    assert 1 <= body.count('<table class="data"') <= 5
    assert appendix.count('<table class="data"') >= 5
    captions = [re.sub(r"<[^>]+>", "", markup) for markup in re.findall(_CAPTIONS, text, re.DOTALL)]
    assert [caption for caption in captions if len(caption.split()) > 60 + 2] == []  # and "Table", and its number
    assert len(captions) > text.count('<table class="data"')
    numbers = [int(n) for n in re.findall(r"<strong>Table (\d+)\.", text)]
    assert numbers == list(range(1, len(numbers) + 1))


def test_a_number_without_a_unit_or_an_interval_is_found_out():
    bad = (
        '<table class="data" id="t"><caption>1</caption><tr><th>trial</th><th>µ</th><th>N<small>[N]</small></th></tr>'
        '<tr><td>7</td><td>0.5<span class="ends">0.4 to 0.6</span></td><td>2.0</td></tr></table>'
    )
    assert list(estimates(bad)) == [
        ("t, µ, 7 0.5 2.0: 0.5", "", "0.4 to 0.6", ""),
        ("t, N, 7 0.5 2.0: 2.0", "[N]", "", ""),
    ]


@pytest.fixture(scope="module")
def browser_page(text, tmp_path_factory):
    if CHROMIUM is None:
        pytest.skip("no Chromium to open the pages in")
    return open_page(tmp_path_factory.mktemp("browser"), text)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to open the pages in")
def test_a_page_that_asks_fails_overlaps_or_is_cut_is_found_out(tmp_path):
    bad_page = (
        '<p>one<img src="http://127.0.0.1:9/x.png"><script>nothing()</script>'
        '<p style="position: absolute; top: 8px">another'
        '<pre style="width: 50px; overflow: auto">far too long a line</pre>'
        '<svg width="50" height="20"><text x="0" y="15">wider than its picture</text></svg>'
    )
    measurements, console, addresses = open_page(tmp_path, bad_page)
    assert "nothing is not defined" in console[0]
    assert addresses == {"http://127.0.0.1:9/x.png"}
    assert measurements["wide"]["overlaps"] == ["one | another"]
    assert measurements["paper"]["cut"] == ["far too long a line"]
    assert measurements["wide"]["beyond"] == ["wider than its picture"]


def test_no_request_leaves_the_page(browser_page):
    measurements, _, addresses = browser_page
    assert all(not frame["fetched"] for frame in measurements.values())
    assert addresses == set()


def test_nothing_is_wrong_in_the_console(browser_page):
    assert browser_page[1] == []


@pytest.mark.parametrize("window", ["narrow", "wide", "paper"])
def test_no_text_lies_over_another_and_the_page_is_no_wider_than_its_window(browser_page, window):
    frame = browser_page[0][window]
    assert frame["texts"] > 200  # there is something to overlap
    assert frame["overlaps"] == []
    assert frame["needed"] <= frame["window"]


@pytest.mark.parametrize("window", ["narrow", "wide", "paper"])
def test_no_label_of_a_picture_goes_beyond_it(browser_page, window):
    assert browser_page[0][window]["beyond"] == []


def test_nothing_is_cut_where_there_is_room_and_on_paper_nothing_at_all(browser_page):
    assert browser_page[0]["wide"]["cut"] == []
    assert browser_page[0]["paper"]["cut"] == []
    assert browser_page[0]["paper"]["tallest"] <= PAPER_HEIGHT  # what does not break fits on a page


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None or PDFTOTEXT is None, reason="no Chromium to print with, or no pdftotext")
def test_every_word_of_every_table_is_on_the_printed_a4_pages(text, tmp_path):
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    target = f"--print-to-pdf={tmp_path / 'page.pdf'}"
    command_line = [CHROMIUM, *FLAGS, f"--user-data-dir={tmp_path / 'p'}", "--no-pdf-header-footer", target]
    subprocess.run([*command_line, (tmp_path / "page.html").as_uri()], capture_output=True, timeout=200, check=True)
    sizes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", (tmp_path / "page.pdf").read_bytes())
    assert {(round(float(w) / 72 * 25.4), round(float(h) / 72 * 25.4)) for w, h in sizes} == {(210, 297)}
    pdf = subprocess.run([PDFTOTEXT, tmp_path / "page.pdf", "-"], capture_output=True, text=True, check=True).stdout
    cells = " ".join(re.findall(r'(?:<td[^>]*>|<span class="ends">)([^<]+)<', text))
    words = {word for word in cells.split() if "&" not in word}
    assert words
    absent = words - set(pdf.split())
    unbroken = re.sub(r"\s+", "", pdf)
    assert {word for word in absent if len(word) <= 60 or word not in unbroken} == set()  # a long one goes on below
    assert next(n for n, sheet in enumerate(pdf.split("\f")) if "Appendix:" in sheet) <= 3
