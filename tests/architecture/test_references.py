"""A reference names its work and the location in it: paper and equation, textbook and section.

What has no section of references is the project's own. Compiled modules say at their head where
their formulas stand, or that they are the project's own.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.paths import ROOT

SERVICE = ROOT / "service/multiradar"
PURE = ("estimation", "restoration", "research")

#: One of the five papers, and the location in it: an equation, the text or a named section.
PAPER = re.compile(
    r"(IMM UrO RAN report \(2016\)|Vasiliev, Mattis|Koptev, Rozov, Romanovsky|Korobochkin"
    r"|Nenartovich, Isakov), [^.]*?(\(\d+(\.\d+)?\)|sections? (\d|on )|figures? \d)"
)
#: Another work: authors, year, and a location in it or its pages.
WORK = re.compile(r"[A-Z][^.]*\..*?\b(19|20)\d\d\)?,?\s.*?(section|chapter|equation|\d+-\d+)")
#: Works cited by title, with numbers instead of pages.
TITLED = re.compile(
    r'(NIST Digital Library|"The Art of Computer Programming").*?(section|table) ?\d'
    r"|technical report \d{4}-\d+|see the head of this module"
)
OWN = re.compile(r"\b[Tt]he project's own\b")


def references(documentation: str) -> str:
    """Return the text of the section, in one line; empty where there is none."""
    _, heading, text = documentation.partition("References\n----------\n")
    return " ".join(text.partition("\n\n")[0].split()) if heading else ""


def names_a_source(text: str) -> bool:
    return any(known.search(text) for known in (PAPER, WORK, TITLED, OWN))


def sections() -> Iterator[tuple[str, str]]:
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(SERVICE.rglob("*.py"))}
    for path in (one for one, text in texts.items() if "References" in text):
        for node in ast.walk(ast.parse(texts[path])):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                text = references(ast.get_docstring(node) or "")
                if text:
                    name = getattr(node, "name", "module")
                    yield f"{path.relative_to(SERVICE).with_suffix('')}:{name}", text


def kernel_modules() -> list[Path]:
    return [path for one in PURE for path in sorted((SERVICE / one).rglob("_*kernels.py"))]


@pytest.mark.parametrize("text", [pytest.param(text, id=name) for name, text in sections()])
def test_a_reference_names_the_work_and_the_place_in_it(text: str) -> None:
    assert names_a_source(text), text


@pytest.mark.parametrize("path", [pytest.param(one, id=one.stem) for one in kernel_modules()])
def test_a_compiled_module_says_at_its_head_where_its_formulas_stand(path: Path) -> None:
    head = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    assert names_a_source(references(head))
