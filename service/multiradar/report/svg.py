"""Figures as SVG: text as text, reproducible bytes, colours by variable or by value."""

import html
import io
import re
from collections.abc import Callable

from matplotlib.figure import Figure

from multiradar.report.colours import ALL, PAPER

_HEAD = re.compile(r"^.*?(?=<svg )", re.DOTALL)
_METADATA = re.compile(r"\s*<metadata>.*?</metadata>", re.DOTALL)
_COMMENT = re.compile(r"\s*<!--.*?-->", re.DOTALL)
_SIZE = re.compile(r' (?:width|height)="[\d.]+pt"')
_ID = re.compile(r' id="([^"]*)"')
_REFERENCE = re.compile(r'(?:url\(|href=")#([^")]+)')
_TAG = re.compile(r"<[^>]*>")
_PATH = re.compile(r' d="([^"]{400,})"')
_STEP = re.compile(r"\s*([A-Za-z])\s*|\s+")
_TENTHS = re.compile(r"(\d+\.\d)\d+")
_LONG_NUMBER = re.compile(r"(\d+\.\d{2})\d+")
_FONT = re.compile(r"font: ([^;\"]*?)'DejaVu Sans'[^;\"]*")
_SPACE_BETWEEN_TAGS = re.compile(r">\s+<")


def inline_svg(figure: Figure, name: str, title: str) -> str:
    """Return a figure as SVG for an HTML page, coloured by the page's CSS variables.

    Parameters
    ----------
    figure : Figure
        Drawn with the placeholders of `multiradar.report.colours`.
    name : str
        Prefix of its ids, which must be unique on the page.
    title : str
        Accessible name of the figure.

    Returns
    -------
    str
        One ``svg`` element without a fixed size.
    """
    return _named(
        _coloured(_cleaned(_drawn(figure)), lambda one: f"var({one.variable})"), name, title
    )


def standalone_svg(figure: Figure, title: str) -> str:
    """Return a figure as a separate SVG file, light, on white.

    Parameters
    ----------
    figure : Figure
        Drawn with the placeholders of `multiradar.report.colours`.
    title : str
        Accessible name of the figure.

    Returns
    -------
    str
        The text of the file.
    """
    text = _coloured(_cleaned(_drawn(figure)), lambda one: one.light)
    width, height = (72.0 * side for side in figure.get_size_inches())
    paper = f'<rect width="{width:g}" height="{height:g}" fill="{PAPER.light}"/>'
    text = _named(text, "plot", title)
    end = text.index(">") + 1
    return text[:end] + paper + text[end:] + "\n"


def _drawn(figure: Figure) -> str:
    buffer = io.StringIO()
    figure.patch.set_visible(False)
    for axes in figure.axes:
        axes.patch.set_visible(False)
    metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(buffer, format="svg", metadata=metadata)
    return buffer.getvalue()


def _cleaned(text: str) -> str:
    text = _COMMENT.sub("", _METADATA.sub("", _HEAD.sub("", text)))
    head, rest = text.split(">", 1)
    text = f"{_SIZE.sub('', head)}>{rest}"
    text = _FONT.sub(r"font: \1system-ui, sans-serif", text)
    text = _PATH.sub(_shortened, text)
    # A hundredth of a point is enough for coordinates; numbers in text are unchanged.
    text = _TAG.sub(lambda tag: _LONG_NUMBER.sub(r"\1", tag[0]), text)
    return _SPACE_BETWEEN_TAGS.sub(">\n<", text).strip()


def _shortened(path: re.Match[str]) -> str:
    # Long lines determine the size of a report; a tenth of a point is a tenth of a pixel.
    steps = _STEP.sub(lambda step: step[1] or " ", _TENTHS.sub(r"\1", path[1]))
    return f' d="{steps.strip()}"'


def _coloured(text: str, value_of: Callable[..., str]) -> str:
    for colour in ALL:
        text = text.replace(colour.mark, value_of(colour))
    return text


def _named(text: str, name: str, title: str) -> str:
    referred = set(_REFERENCE.findall(text))

    def renamed(match: re.Match[str]) -> str:
        return f' id="{name}-{match[1]}"' if match[1] in referred else ""

    text = _ID.sub(renamed, text)
    text = text.replace("url(#", f"url(#{name}-").replace('href="#', f'href="#{name}-')
    return text.replace("<svg ", f'<svg role="img" aria-label="{html.escape(title)}" ', 1)
