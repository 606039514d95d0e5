"""Names, messages, comments and documents use the words of the field."""

import re
from pathlib import Path

import pytest

from architecture.test_sources import modules, text
from support.paths import ROOT

#: What readers of the field would not search for, and what to say in its place.
INSTEAD = {
    r"(?:un)?told|tells?|telling": "report, publish, give, distinguish",
    r"heed(?:s|ed)?": "contribute",
    r"lean": "minimal",
    r"(?:quiet|loud)(?:er|est|ly)?": "contributes to the bias estimate, or does not",
    r"looks": "detection opportunities, scans",
    r"printed": "published",
    r"begun|anew|in vain|as yet": "initiated, again; rewrite the sentence",
    r"who(?:m)?ever|nobody": "rewrite the sentence",
    r"surpris(?:e|es|ed|ing)": "normalised innovation, outlier",
    r"verdicts?|judg(?:e|es|ed|ing|ement)": "result, evaluate",
    r"torn": "broken",
    r"fans?": "forecast ensemble",
    r"refus(?:e|es|ed|als?|ing)": "reject",
    r"remember(?:s|ed|ing)?|forg(?:ets?|ot|otten)": "retain, discard",
    r"kept back": "withheld",
    r"leads? on|led on": "extrapolate, predict",
    r"taken off|put right": "subtract, correct",
    r"nine in ten": "90th percentile",
    r"def take[ns]?": "push, filter, update, observe, select",
}
BANNED = re.compile(rf"(?<![a-z])(?:{'|'.join(INSTEAD)})(?![a-z])")

#: Columns, keys, codes, options and names of others, which stay as they are.
PUBLISHED = re.compile(
    r"printed_(?:statistic|threshold)|refused_by_printed_(?:criterion|share)|\w*_as_printed_share"
    r"|refused_share|(?:queries|messages|records|plots)_refused|refused_by_code|refuse_nis"
    r"|refusals_max|(?:imm_)?surprise_(?:gain|floor|density)|plots_judged|not_judged"
    r"|REFUSED|REQUEST_REFUSED|RefusedRow|multiradar_(?:http_refusals|asterix_refused)"
    r"|Connection ?[Rr]efused(?:Error)?|forecast-fan|places led on"
    r"|(?:\+|\d) refused|as printed|--quiet|\blooks\b|[\"'`]+(?:refused|printed|verdict)[\"'`]"
)
_PART = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|_")


def texts() -> list[str]:
    """Return the programs and the documents."""
    pages = sorted(path for path in (ROOT / "docs").rglob("*.md"))
    pages += [
        ROOT / name
        for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "DECISIONS.md", "Makefile")
    ]
    here = Path(__file__).relative_to(ROOT).as_posix()
    programs = modules("service/", "converters/", "schemas/", "compiled/", "validation/", "tests/")
    return [path.relative_to(ROOT).as_posix() for path in pages] + sorted(set(programs) - {here})


def test_words_are_those_of_the_field() -> None:
    found = []
    for name in texts():
        # No word extends over lines: a text in which there is none is not divided.
        if not _banned(text(name)):
            continue
        for number, line in enumerate(text(name).splitlines(), 1):
            left = _banned(PUBLISHED.sub("", line))
            found += [f"{name}:{number}: {one}: {line}" for one in left]
    assert found == []


def _banned(words: str) -> list[str]:
    # In lower case, as a comparison regardless of case takes four times as long.
    return BANNED.findall(_PART.sub(" ", words).lower())


@pytest.mark.parametrize("line", ["def toldBy(self):", "it was kept_back", "A Fan.", "x_refused_y"])
def test_a_banned_word_is_found_within_a_text(line: str) -> None:
    assert len(_banned(line)) == 1
    assert _banned(f"before\n{line}\nafter") == _banned(line)
