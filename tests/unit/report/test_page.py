"""The report is one valid page that loads nothing, for any texts."""

import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest

from multiradar.report.page import CONTENTS_MIN, report_page
from multiradar.research.studies.document import document_of
from multiradar.research.studies.result import StudyOptions, StudyResult
from support.fakes.fake_study import ENTRY, HOSTILE

VOID = {"meta", "br", "link", "img", "hr", "input"}
#: Namespaces are written as addresses, but nothing is loaded from them.
NAMESPACES = ("http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink")


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return ENTRY.run(StudyOptions(), lambda _done, _total: None)


@pytest.fixture(scope="module")
def page(result: StudyResult) -> str:
    return report_page(document_of(result))


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


@pytest.fixture(scope="module")
def read(page: str) -> _Reader:
    reader = _Reader()
    reader.feed(page)
    reader.close()
    return reader


def test_every_element_is_closed_where_it_was_opened(read: _Reader) -> None:
    assert read.open == []
    assert [tag for tag, _ in read.tags].count("h1") == 1


def test_nothing_is_fetched_and_nothing_runs(page: str, read: _Reader) -> None:
    without = page
    for namespace in NAMESPACES:
        without = without.replace(f'"{namespace}"', '""')
    assert "://" not in without
    assert "@import" not in page
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", page))
    fetching = {"script", "link", "img", "iframe", "object", "embed", "image", "base"}
    assert fetching.isdisjoint(tag for tag, _ in read.tags)
    for _tag, attributes in read.tags:
        assert not any(name.startswith("on") for name in attributes)
        for name in ("href", "xlink:href", "src"):
            assert (attributes.get(name) or "#").startswith("#")
    policies = [attributes for _, attributes in read.tags if "http-equiv" in attributes]
    assert (policies[0]["content"] or "").startswith("default-src 'none'")


def test_texts_of_a_study_are_escaped(page: str, read: _Reader) -> None:
    shown = "".join(read.text)
    # Title, headings, captions, cells, notes and legends.
    assert shown.count(HOSTILE) >= 8
    assert "<script" not in page


def test_every_picture_is_valid_and_its_ids_are_unique(page: str) -> None:
    pictures = re.findall(r"<svg role.*?</svg>", page, re.DOTALL)
    assert len(pictures) == 3
    for picture in pictures:
        root = ElementTree.fromstring(picture)
        assert root.get("aria-label")
        assert "viewBox" in root.attrib
        assert "width" not in root.attrib
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(ids) == len(set(ids))
    referred = set(re.findall(r'(?:url\(|href=")#([^")]+)', page))
    assert referred <= set(ids)


def test_labels_in_pictures_are_text(page: str) -> None:
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", page)
    assert {"time, s", "error, m", "x, km"} <= set(texts)


def test_colours_are_css_variables_and_follow_the_colour_scheme(page: str) -> None:
    assert "#0a0b" not in page
    assert "prefers-color-scheme:dark" in page
    variables = set(re.findall(r"var\((--[a-z0-9-]+)\)", page))
    assert variables <= set(re.findall(r"(--[a-z0-9-]+):", page))
    assert {"--ink", "--faint", "--grid", "--series-0"} <= variables


def test_the_report_shows_its_command(read: _Reader) -> None:
    command = "multiradar study fake --runs 3 --filters joint,two-stage,ci --duration 10 --seed 1"
    assert command in read.text


def test_the_same_result_gives_the_same_bytes(result: StudyResult, page: str) -> None:
    assert report_page(document_of(result)) == page


def test_a_long_report_starts_with_links_to_its_sections(result: StudyResult) -> None:
    table = result.tables[0]
    long = StudyResult("s", "S", 1, [], [table] * CONTENTS_MIN, [])
    targets = re.findall(r'<a href="#([^"]*)">', report_page(document_of(long)))
    assert targets == re.findall(r'<section id="([^"]*)">', report_page(document_of(long)))
    assert len(targets) == CONTENTS_MIN
    short = StudyResult("s", "S", 1, [], [table] * (CONTENTS_MIN - 1), [])
    assert "<nav" not in report_page(document_of(short))


def test_a_result_without_plots_or_notes_is_a_page() -> None:
    bare = report_page(document_of(StudyResult("s", "S", 1, [], [], [])))
    assert "<h1>S</h1>" in bare
    assert "Notes" not in bare
