"""Who reads a formula finds where it stands: paper and equation, textbook and section, or "own".

Held for the public functions, methods and classes of the estimation and the restoration, and for
the modules of the simulation and of the studies that compute. What implements no formula is
excepted by kind: the three kinds are named below, with their reasons.
"""

import ast
import re
from collections.abc import Iterator

import pytest

from support.paths import ROOT

SERVICE = ROOT / "service/multiradar"

PURE = (
    "estimation",
    "restoration",
    "research/sequential",
    "research/extended",
    "research/motion",
    "research/bundle",
)
#: Where the simulation and the studies compute; their other modules read, write, and draw.
COMPUTING = (
    "simulation/biases",
    "simulation/observation/clutter",
    "simulation/flat",
    "simulation/observation/jamming",
    "simulation/observation/looks",
    "simulation/observation/observation",
    "simulation/paths",
    "research/studies/bearing_only/study",
    "research/studies/bearing_only/runs",
    "research/studies/bias_estimation/study",
    "research/studies/bias_estimation/bands",
    "research/studies/bias_estimation/loss",
    "research/studies/bias_estimation/runs",
    "research/studies/coupled_motion/study",
    "research/studies/coupled_motion/figures",
    "research/studies/coupled_motion/models",
    "research/studies/coupled_motion/tracking",
    "research/studies/manoeuvre_plane/study",
    "research/studies/manoeuvre_plane/runs",
    "research/studies/polynomial_forecast/study",
    "research/studies/polynomial_forecast/runs",
    "research/studies/trajectory_bundle/study",
    "research/studies/trajectory_bundle/runs",
)

#: They look at shape, sign and order of what comes from outside, and compute nothing.
CHECKS = {
    "estimation/array_checks": None,
    "estimation/motion/inputs": None,
    "estimation/gaussian": {"require_covariance"},
    "research/sequential/player": {"record_times"},
    "research/sequential/sensor_checks": None,
}
#: They make room in memory, find a filter by its name, or choose rows.
BOOKKEEPING = {
    "estimation/filters/arrays": None,
    "estimation/filters/bank": {"find_filter", "find_filter_for"},
    "research/sequential/player": {"empty_record"},
    "restoration/geometry/plot_positions": {"Plots", "Plots.take"},
    "simulation/observation/looks": {"outside_gaps"},
    "research/studies/coupled_motion/tracking": {"Tracked", "Tracked.means", "settled", "batches"},
}
#: Bases and decorators of classes that hold what others computed; see `holds_only`.
CONTAINERS = {"NamedTuple", "IntEnum", "dataclass"}

#: A paper of the five, and the place in it: an equation, the text or a section of its own name.
PAPER = re.compile(
    r"(IMM UrO RAN report \(2016\)|Vasiliev, Mattis|Koptev, Rozov, Romanovsky|Korobochkin"
    r"|Nenartovich, Isakov), [^.]*?(\(\d+(\.\d+)?\)|sections? (\d|on )|figures? \d)"
)
#: A work of others: authors, year, and a place in it or its pages.
WORK = re.compile(r"[A-Z][^.]*\..*?\b(19|20)\d\d\)?,?\s.*?(section|chapter|equation|\d+-\d+)")
#: Works that are known by their title, which have numbers in place of pages.
TITLED = re.compile(
    r'(NIST Digital Library|"The Art of Computer Programming").*?(section|table) ?\d'
)
OWN = re.compile(r"\b[Tt]he project's own\b")

Definition = ast.FunctionDef | ast.ClassDef


def holds_only(node: ast.ClassDef) -> bool:
    """Say whether a class is a container whose methods are properties, which only read it."""
    marks = [ast.unparse(mark).split("(")[0] for mark in (*node.bases, *node.decorator_list)]
    methods = [one for one in node.body if isinstance(one, ast.FunctionDef) and is_public(one)]
    return bool(CONTAINERS & set(marks)) and all(is_property(one) for one in methods)


def is_property(node: ast.FunctionDef) -> bool:
    return "property" in [ast.unparse(mark) for mark in node.decorator_list]


def is_public(node: Definition) -> bool:
    return not node.name.startswith("_")


def definitions(module: ast.Module) -> Iterator[tuple[str, Definition]]:
    for node in module.body:
        if not isinstance(node, Definition) or not is_public(node):
            continue
        if isinstance(node, ast.ClassDef) and holds_only(node):
            continue
        yield node.name, node
        for part in node.body if isinstance(node, ast.ClassDef) else ():
            if isinstance(part, ast.FunctionDef) and is_public(part):
                yield f"{node.name}.{part.name}", part


def excepted(module: str, name: str) -> bool:
    for kind in (CHECKS, BOOKKEEPING):
        names = kind.get(module, set())
        if names is None or name in names:
            return True
    return False


def judged() -> list[tuple[str, Definition]]:
    found = []
    computing = [SERVICE / f"{name}.py" for name in COMPUTING]
    pure = [path for one in PURE for path in sorted((SERVICE / one).rglob("*.py"))]
    for path in (*pure, *computing):
        module = path.relative_to(SERVICE).with_suffix("").as_posix()
        if path.name.startswith("_"):
            continue
        found += [
            (f"{module}:{name}", node)
            for name, node in definitions(ast.parse(path.read_text(encoding="utf-8")))
            if not excepted(module, name)
        ]
    return found


def references(documentation: str) -> str:
    """Return the text of the section, in one line; empty where there is none."""
    _, heading, text = documentation.partition("References\n----------\n")
    return " ".join(text.partition("\n\n")[0].split()) if heading else ""


def tells_its_source(documentation: str) -> bool:
    text = references(documentation)
    return any(known.search(text) for known in (PAPER, WORK, TITLED, OWN))


@pytest.mark.parametrize("node", [pytest.param(node, id=name) for name, node in judged()])
def test_what_computes_says_where_its_formula_stands(node: Definition) -> None:
    assert tells_its_source(ast.get_docstring(node) or ""), node.name


def test_every_compiled_module_says_at_its_head_where_its_formulas_stand() -> None:
    kernels = [path for one in PURE for path in sorted((SERVICE / one).rglob("_*kernels.py"))]
    heads = {one: ast.get_docstring(ast.parse(one.read_text(encoding="utf-8"))) for one in kernels}
    assert kernels
    assert [one.name for one, head in heads.items() if not tells_its_source(head or "")] == []


def test_the_exceptions_are_there() -> None:
    """A name that is gone, or now has its reference, leaves the list."""
    stale = []
    for kind in (CHECKS, BOOKKEEPING):
        for module, names in kind.items():
            tree = ast.parse((SERVICE / f"{module}.py").read_text(encoding="utf-8"))
            found = dict(definitions(tree))
            for name in names or ():
                node = found.get(name)
                if node is None or tells_its_source(ast.get_docstring(node) or ""):
                    stale.append(f"{module}:{name}")
    assert stale == []


@pytest.mark.parametrize(
    ("section", "enough"),
    [
        ("IMM UrO RAN report (2016), equation (1.45).", True),
        ("IMM UrO RAN report (2016), section 1.4.", True),
        ("IMM UrO RAN report (2016).", False),
        ("Vasiliev, Mattis, the text after equation (2).", True),
        ("Vasiliev, Mattis.", False),
        ("Korobochkin, equation (1.8).", True),
        ("Nenartovich, Isakov, the text after equation (10).", True),
        ("Nenartovich, Isakov.", False),
        ('B. Friedland, "Treatment of bias", IEEE TAC 14 (1969), 359-367.', True),
        ("Friedland.", False),
        ("The project's own rule.", True),
        ("See elsewhere.", False),
        ("", False),
    ],
)
def test_a_source_without_its_place_is_not_enough(section: str, enough: bool) -> None:
    heading = "References\n----------\n"
    assert tells_its_source(f"Return x.\n\n{heading}{section}\n\nExamples\n--------\n") is enough
    assert not tells_its_source(f"Return x.\n\n{section}")
