"""Names that a protocol, a subject or an import brought stay words: in pages, in pictures, and in spreadsheets."""

import csv
import io
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from report_example import bare, example
from study_example import study

from sessions.exchange.csv_text import harmless, plain, write_rows
from sessions.report.figures import plates
from sessions.report.figures.style import look, sheet, svg
from sessions.report.pages import page, panel_csv, study_page

SCRIPT = 'q"><script>document.title="X"</script><g x="'
SVG = re.compile(r"<svg.*?</svg>", re.DOTALL)


class Elements(HTMLParser):
    """Collects the elements of a page and the policy it states."""

    def __init__(self):
        super().__init__()
        self.names, self.ids, self.policy = [], [], None

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.names.append(tag)
        self.ids += [attributes["id"]] if "id" in attributes else []
        if attributes.get("http-equiv") == "Content-Security-Policy":
            self.policy = attributes["content"]


def elements_of(text):
    """Return the elements of a page."""
    elements = Elements()
    elements.feed(text)
    return elements


def hostile(report):
    """Return the report with a script for the name of its first experiment."""
    old = report.experiments[0].name
    return replace(
        report,
        title=SCRIPT,
        experiments=(replace(report.experiments[0], name=SCRIPT),),
        strokes=tuple(replace(s, experiment=SCRIPT) for s in report.strokes if s.experiment == old),
        predictions=tuple(replace(p, experiment=SCRIPT) for p in report.predictions if p.experiment == old),
    )


@pytest.fixture(scope="module")
def report():
    return hostile(example(strokes=example().strokes[:2]))  # one of each kind of picture is enough


@pytest.fixture(scope="module")
def drawings(report):
    return plates(report)


def test_a_protocol_named_like_a_script_brings_no_element_into_the_page(report, drawings):
    elements = elements_of(page(report, drawings))
    assert "script" not in elements.names
    assert len(elements.ids) == len(set(elements.ids))
    assert all(re.fullmatch(r"[\w.:-]+", name) for name in elements.ids)


def test_every_picture_of_such_a_page_is_valid_xml(report, drawings):
    for plate in drawings:
        for panel in plate.panels:
            ET.fromstring(panel.svg)
    for picture in SVG.findall(page(report, drawings)):
        ET.fromstring(picture.replace("xlink:href", "href"))


def test_a_name_with_control_characters_and_dollar_signs_still_makes_a_picture_that_xml_allows():
    with look():
        figure = sheet(200, 100)
        figure.axes[0].set_title("a $\\frac$")
        ET.fromstring(svg(figure, "a\x01b", "a\x01b"))


def test_different_names_have_different_identifiers():
    with look():
        first, second = (svg(sheet(100, 50), name, name) for name in ("a b", "a_b"))
    assert not set(re.findall(r'\bid="([^"]+)"', first)) & set(re.findall(r'\bid="([^"]+)"', second))


@pytest.mark.parametrize(
    "text", [lambda: page(bare()), lambda: study_page(study(), "example")], ids=["report", "study"]
)
def test_every_page_forbids_scripts_and_asks_no_network(text):
    policy = elements_of(text()).policy
    assert policy is not None
    assert "default-src 'none'" in policy
    assert "script-src" not in policy


@pytest.mark.parametrize("text", ["=1+1", "+cmd", "-2+3", "@SUM(A1)", "\t=1", "\r=1", "'=1", "''=1", "'tis", "K3", ""])
def test_a_text_cell_survives_and_begins_like_no_formula(text):
    assert not str(harmless(text)).startswith(("=", "+", "-", "@", "\t", "\r"))
    assert plain(str(harmless(text))) == text


@pytest.mark.parametrize("number", [-1.5, "-1.5", "+2", "-inf", 0, None])
def test_a_number_stays_as_it_is(number):
    out = io.StringIO()
    write_rows(out, [[number, "x"]])
    assert next(csv.reader([out.getvalue()]))[0] == ("" if number is None else str(number))


def test_the_numbers_beside_a_picture_hold_no_formula(drawings):
    panel = replace(drawings[0].panels[0], rows=(("=HYPERLINK(1)", 1.0),), header=("name", "x"))
    assert "'=HYPERLINK(1)" in panel_csv(panel, "")
