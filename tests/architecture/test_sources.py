"""Project rules that no tool checks, from the syntax trees of the tracked files."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from support.paths import ROOT
from support.processes.waiting import run_to_end

CODE = ("service", "converters", "schemas")
LINES_MAX = 500
#: The only module that may read the time of day.
CLOCK = "service/multiradar/clock.py"
CORE = (
    "service/multiradar/tracking",
    "service/multiradar/restoration",
    "service/multiradar/estimation",
    "service/multiradar/geodesy",
    "service/multiradar/research/sequential",
    "service/multiradar/research/extended",
    "service/multiradar/research/motion",
    "service/multiradar/research/bundle",
)


@cache
def tracked() -> tuple[str, ...]:
    listed = run_to_end(["git", "ls-files"], cwd=ROOT)
    assert listed.returncode == 0, listed.stderr
    return tuple(name for name in listed.stdout.splitlines() if (ROOT / name).is_file())


@cache
def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8", errors="replace")


def modules(*folders: str) -> list[str]:
    return [name for name in tracked() if name.endswith(".py") and name.startswith(folders)]


@cache
def tree(name: str) -> ast.Module:
    return ast.parse(text(name), filename=name)


@cache
def nodes(name: str) -> list[ast.AST]:
    return walk(tree(name))


def walk(root: ast.AST) -> list[ast.AST]:
    """Return what `ast.walk` yields but for contexts of names, in a third of its time."""
    found = [root]
    # It grows meanwhile.
    for node in found:
        for value in vars(node).values():
            if type(value) is list:
                found += [one for one in value if isinstance(one, ast.AST)]
            elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
                found.append(value)
    return found


def test_sources_are_found() -> None:
    assert len(modules(*CODE)) > 20


def test_no_module_is_longer_than_the_limit() -> None:
    long = {name: text(name).count("\n") for name in modules(*CODE, "tests")}
    assert {name: lines for name, lines in long.items() if lines > LINES_MAX} == {}


def test_nothing_is_left_undone() -> None:
    marks = re.compile(r"\b(TODO|FIXME|XXX|HACK)\b")
    this = Path(__file__).relative_to(ROOT).as_posix()
    marked = [name for name in modules(*CODE, "tests") if name != this and marks.search(text(name))]
    unfinished = [
        f"{name}:{node.lineno}"
        for name in modules(*CODE)
        if "NotImplementedError" in text(name)
        for node in nodes(name)
        if isinstance(node, ast.Name) and node.id == "NotImplementedError"
    ]
    assert (marked, unfinished) == ([], [])


def test_no_conflict_of_a_merge_is_left() -> None:
    mark = re.compile(r"^(?:<{7} |={7}$|>{7} )", re.MULTILINE)
    pages = [path for path in ROOT.glob("docs/**/*.md")] + list(ROOT.glob("*.md"))
    left = [name for name in modules(*CODE, "tests") if mark.search(text(name))]
    left += [path.name for path in pages if mark.search(path.read_text(encoding="utf-8"))]
    assert left == []


def test_no_error_is_swallowed() -> None:
    swallowed = [
        f"{name}:{node.lineno}"
        for name in modules(*CODE, "tests")
        if "except" in text(name)
        for node in nodes(name)
        if isinstance(node, ast.ExceptHandler) and all(_says_nothing(part) for part in node.body)
    ]
    assert swallowed == []


def _says_nothing(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return True
    return isinstance(statement, ast.Pass)


def test_only_the_clock_module_reads_the_clock() -> None:
    readers = [
        name
        for name in modules(*CODE)
        if name != CLOCK
        and re.search(r"\b(time|date|datetime)\b", text(name))
        and any(_reads_clock(node) for node in nodes(name))
    ]
    assert readers == []


_CLOCKS = re.compile(
    r"(?:.*\.)?(?:time\.(?:time|time_ns|monotonic|monotonic_ns|perf_counter|perf_counter_ns)"
    r"|(?:datetime|date)\.(?:now|utcnow|today))"
)


def _reads_clock(node: ast.AST) -> bool:
    if isinstance(node, ast.ImportFrom) and node.module == "time":
        return any(_CLOCKS.fullmatch(f"time.{alias.name}") for alias in node.names)
    return isinstance(node, ast.Attribute) and _CLOCKS.fullmatch(ast.unparse(node)) is not None


def test_no_tracked_file_names_a_machine_or_an_index_of_packages() -> None:
    machine = re.compile(
        r"(?<![\w.])/(?:work|root|home/\w+|tmp/team)/|pypi\.(?:org|io)|pythonhosted"
    )
    this = Path(__file__).relative_to(ROOT).as_posix()
    names = [name for name in tracked() if name != this and machine.search(text(name))]
    assert names == []


def public_functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    for name in modules(*CORE):
        if Path(name).name.startswith("_"):
            continue
        yield from ((f"{name}:{node.name}", node) for node in public(tree(name).body))
        for one in tree(name).body if name.startswith(CORE[1]) else ():
            if isinstance(one, ast.ClassDef) and not one.name.startswith("_"):
                yield from ((f"{name}:{one.name}.{node.name}", node) for node in public(one.body))


def public(body: list[ast.stmt]) -> Iterator[ast.FunctionDef]:
    """Yield functions, and methods except properties."""
    for node in body:
        if not isinstance(node, ast.FunctionDef) or node.name.startswith("_"):
            continue
        if "property" not in [ast.unparse(mark) for mark in node.decorator_list]:
            yield node


@pytest.mark.parametrize(
    "function", [pytest.param(node, id=name) for name, node in public_functions()]
)
def test_public_functions_of_the_core_say_what_they_take_and_give(
    function: ast.FunctionDef,
) -> None:
    documentation = ast.get_docstring(function) or ""
    named = [*function.args.args, *function.args.kwonlyargs, *function.args.posonlyargs]
    arguments = [one for one in named if one.arg != "self"]
    assert not arguments or "Parameters\n---" in documentation
    gives_nothing = isinstance(function.returns, ast.Constant) and function.returns.value is None
    assert gives_nothing or "Returns\n---" in documentation or "Yields\n---" in documentation
    raises = any(isinstance(node, ast.Raise) for node in walk(function))
    assert not raises or "Raises\n---" in documentation


def test_rates_of_angles_are_named_in_one_way() -> None:
    """`turn_rate_rad_per_s` everywhere; degrees only where tables and command lines are read."""
    other = re.compile(r"(?<![a-z])(rad|deg)(ps|_s|_sec|_per_sec)(?![a-z])", re.IGNORECASE)
    columns = {"track_angle_rate_deg_s"}
    words = {
        f"{name}: {word}"
        for name in modules(*CODE, "tests")
        if other.search(text(name))
        for node in nodes(name)
        for word in (getattr(node, "id", None), getattr(node, "arg", None))
        if isinstance(word, str) and other.search(word) and word not in columns
    }
    assert sorted(words) == []


def test_packages_of_the_service_say_what_they_are_for() -> None:
    silent = [
        name
        for name in modules(*CODE)
        if Path(name).name == "__init__.py" and not ast.get_docstring(tree(name))
    ]
    assert silent == []


def test_no_module_is_a_drawer_for_everything() -> None:
    drawers = {"utils", "util", "helpers", "common", "functions", "lib", "misc"}
    assert [
        name for name in modules(*CODE) if drawers & set(Path(name).with_suffix("").parts)
    ] == []


def test_property_tests_choose_how_many_examples_they_draw_and_nothing_else() -> None:
    """Everything else is in the profiles, so that property tests are reproducible."""
    chosen = {
        f"{name}:{node.lineno}: {word.arg}"
        for name in modules("tests/")
        if name != "tests/conftest.py" and "settings(" in text(name)
        for node in nodes(name)
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "settings"
        for word in node.keywords
    }
    assert {one for one in chosen if not one.endswith(": max_examples")} == set()
