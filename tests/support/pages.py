"""Pages read by a real parser: balanced, accessible, without anything foreign."""

import re
from html.parser import HTMLParser
from pathlib import Path

_VOID = {"meta", "link", "img", "br", "hr", "input", "base"}
_FETCHING = {"script", "link", "img", "iframe", "object", "embed", "image", "base"}
_NAMESPACES = ("http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink")


class PageReader(HTMLParser):
    """Collects tags and headings of a page; fails where an element is not closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.headings: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)
        if tag in {"h1", "h2", "h3"}:
            self.headings.append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in {"h1", "h2", "h3"}:
            self.headings[-1] += data


def read_page(path: Path) -> PageReader:
    """Return a page as parsed, after checks that hold for every page."""
    text = path.read_text(encoding="utf-8")
    reader = PageReader()
    reader.feed(text)
    reader.close()
    assert reader.open == []
    names = [tag for tag, _ in reader.tags]
    assert names.count("h1") == 1
    assert _FETCHING.isdisjoint(names)
    for namespace in _NAMESPACES:
        text = text.replace(f'"{namespace}"', '""')
    assert "://" not in text
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", text))
    identifiers = [one["id"] for _, one in reader.tags if "id" in one]
    assert len(identifiers) == len(set(identifiers))
    for tag, attributes in reader.tags:
        assert not any(name.startswith("on") for name in attributes)
        if tag == "th":
            assert attributes.get("scope") == "col"
        if tag == "svg":
            assert attributes.get("aria-label") or attributes.get("aria-hidden") == "true"
    return reader
