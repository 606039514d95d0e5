"""The HTML report: one self-contained file, light and dark, for print and small screens."""

import html
import itertools
from collections.abc import Mapping, Sequence
from importlib.resources import files

from multiradar.report.cells import numeric_columns, table_texts
from multiradar.report.colours import ALL, Colour, assign_colours
from multiradar.report.content import Document, Plot, Table
from multiradar.report.drawing import draw_group, plain_state
from multiradar.report.legend import legend_html
from multiradar.report.svg import inline_svg

#: Number of sections from which the page has a list of contents.
CONTENTS_MIN = 6
#: The page must not run scripts or load anything.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"


def report_page(document: Document) -> str:
    """Return a report as one HTML page.

    Returns
    -------
    str
        The same text for the same document; all its texts are escaped.
    """
    colours = assign_colours(document.plots)
    groups = _groups(document.plots)
    with plain_state():
        drawn = [_figures(number, group, colours) for number, group in enumerate(groups, 1)]
    tables = [(table.title, _table(table)) for table in document.tables]
    sections = [*tables[:1], *drawn, *tables[1:], *_notes(document.notes)]
    parts = [
        "<!DOCTYPE html>\n",
        '<html lang="en">\n<head>\n<meta charset="utf-8">\n',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n',
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n',
        '<meta name="color-scheme" content="light dark">\n',
        f"<title>{html.escape(document.title)}</title>\n",
        f"<style>\n{_style()}</style>\n</head>\n<body>\n",
        _header(document),
        _contents([heading for heading, _ in sections]),
        "<main>\n",
        *(_section(number, *section) for number, section in enumerate(sections, 1)),
        "</main>\n</body>\n</html>\n",
    ]
    return "".join(parts)


def _style() -> str:
    light = "".join(f"{colour.variable}:{colour.light};" for colour in ALL)
    dark = "".join(f"{colour.variable}:{colour.dark};" for colour in ALL)
    rules = files("multiradar.report").joinpath("style.css").read_text(encoding="utf-8")
    return (
        f":root{{{light}}}\n"
        f"@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{rules}"
    )


def _header(document: Document) -> str:
    summary = (
        f'<p class="summary">{html.escape(document.summary)}</p>\n' if document.summary else ""
    )
    return (
        f"<header>\n<h1>{html.escape(document.title)}</h1>\n{summary}"
        f'<p class="command">Made by <code>{html.escape(document.command)}</code></p>\n'
        "</header>\n"
    )


def _contents(headings: Sequence[str]) -> str:
    if len(headings) < CONTENTS_MIN:
        return ""
    items = "".join(
        f'<li><a href="#section-{number}">{html.escape(heading)}</a></li>\n'
        for number, heading in enumerate(headings, 1)
    )
    summary = f"<summary>Contents: {len(headings)} sections</summary>"
    return f"<nav>\n<details>\n{summary}\n<ol>\n{items}</ol>\n</details>\n</nav>\n"


def _section(number: int, heading: str, content: str) -> str:
    return (
        f'<section id="section-{number}">\n<h2>{html.escape(heading)}</h2>\n{content}</section>\n'
    )


def _groups(plots: Sequence[Plot]) -> list[list[Plot]]:
    # Plots without a group are shown separately.
    keyed = itertools.groupby(enumerate(plots), key=lambda pair: pair[1].group or pair[0])
    return [[plot for _, plot in pairs] for _, pairs in keyed]


def _figures(number: int, group: Sequence[Plot], colours: Mapping[str, Colour]) -> tuple[str, str]:
    legend = legend_html(group, colours)
    figures = draw_group(group, colours)
    titled = [
        (plot, inline_svg(figure, f"plot{number}-{index}", plot.title))
        for index, (plot, figure) in enumerate(zip(group, figures, strict=True), 1)
    ]
    heading = group[0].group or group[0].title
    cells = "".join(_figure(plot, svg, shown=bool(plot.group)) for plot, svg in titled)
    kind = "side-by-side" if len(group) > 1 else "map" if group[0].equal_axes else "alone"
    return heading, f'{legend}<div class="{kind}">\n{cells}</div>\n'


def _figure(plot: Plot, svg: str, *, shown: bool) -> str:
    title = f"<h3>{html.escape(plot.title)}</h3>\n" if shown else ""
    caption = f"<figcaption>{html.escape(plot.caption)}</figcaption>\n" if plot.caption else ""
    return f'<figure>\n{title}<div class="picture">{svg}</div>\n{caption}</figure>\n'


def _table(table: Table) -> str:
    right = [' class="number"' if numeric else "" for numeric in numeric_columns(table)]
    head = "".join(
        f'<th scope="col"{side}>{html.escape(name)}</th>'
        for name, side in zip(table.header, right, strict=True)
    )
    body = "".join(
        "<tr>"
        + "".join(
            f"<td{side}>{html.escape(text)}</td>" for text, side in zip(row, right, strict=True)
        )
        + "</tr>\n"
        for row in table_texts(table)
    )
    caption = f'<p class="caption">{html.escape(table.caption)}</p>\n' if table.caption else ""
    return (
        f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}</tbody>\n</table></div>\n{caption}"
    )


def _notes(notes: Sequence[str]) -> list[tuple[str, str]]:
    items = "".join(f"<li>{html.escape(note)}</li>\n" for note in notes)
    return [("Notes", f'<ul class="notes">\n{items}</ul>\n')] if notes else []
