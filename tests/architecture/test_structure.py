"""Folders that are seen at a glance, modules of one subject, and no circles of imports."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path, PurePosixPath

import pytest

from architecture.test_sources import nodes
from support.paths import ROOT
from support.processes.waiting import run_to_end

#: Folders of the packages, by their names.
PACKAGES = {
    "multiradar": "service/multiradar",
    "multiradar_converters": "converters/multiradar_converters",
    "multiradar_schemas": "schemas/multiradar_schemas",
    "multiradar_compiled": "compiled/multiradar_compiled",
}
#: Modules and folders that a folder shows at most; the top of the service shows its layers.
ENTRIES_MAX, TOP_ENTRIES_MAX = 18, 25
TOP = PACKAGES["multiradar"]
#: Lines of a module: one that comes near 500 is to be divided by subject, not squeezed.
LINES_MAX, KERNEL_LINES_MAX = 470, 500

Graph = dict[str, set[str]]


@cache
def modules() -> tuple[str, ...]:
    listed = run_to_end(["git", "ls-files", "*.py"], cwd=ROOT)
    assert listed.returncode == 0, listed.stderr
    return tuple(name for name in listed.stdout.splitlines() if (ROOT / name).is_file())


def product() -> Iterator[str]:
    return (name for name in modules() if name.startswith(tuple(PACKAGES.values())))


def test_no_folder_is_wider_than_the_limit() -> None:
    shown = widths([name for name in modules() if not name.startswith("docs/")])
    too_wide = {
        folder: width
        for folder, width in shown.items()
        if width > (TOP_ENTRIES_MAX if folder == TOP else ENTRIES_MAX)
    }
    assert (len(shown) > 100, too_wide) == (True, {})


def widths(names: list[str]) -> dict[str, int]:
    """Return the number of modules and folders that each folder shows."""
    entries: dict[str, set[str]] = defaultdict(set)
    for name in names:
        path = PurePosixPath(name)
        if path.name == "__init__.py":
            path = path.parent
        for entry in (path, *path.parents[:-1]):
            entries[str(entry.parent)].add(entry.name)
    return {folder: len(found) for folder, found in entries.items()}


def test_widths_are_those_of_modules_and_folders() -> None:
    names = ["a/b/__init__.py", "a/b/one.py", "a/b/c/two.py", "a/three.py"]
    assert widths(names) == {".": 1, "a": 2, "a/b": 2, "a/b/c": 1}


def test_no_module_comes_near_the_limit_of_500_lines() -> None:
    lines = {name: (ROOT / name).read_text(encoding="utf-8").count("\n") for name in product()}
    most = {name: KERNEL_LINES_MAX if "kernels" in Path(name).name else LINES_MAX for name in lines}
    assert {name: count for name, count in lines.items() if count > most[name]} == {}


def test_no_module_has_the_name_of_its_folder() -> None:
    """`engine/engine.py` does not say what it holds."""
    named = [name for name in product() if Path(name).stem == Path(name).parent.name]
    assert named == KERNELS_NAMED


#: Renamed with the next change of kernels, since each compiles all of them again.
KERNELS_NAMED = ["service/multiradar/tracking/lifecycle/lifecycle.py"]


def test_no_circle_of_imports() -> None:
    """Neither between modules nor, within any folder, between its modules and folders."""
    names = {module_name(name): name for name in product()}
    edges: Graph = {name: imported(path, names) for name, path in names.items()}
    assert sum(map(len, edges.values())) > 1000
    assert circle(edges) == []
    folders = {name.rpartition(".")[0] for name in names}
    circles = {folder for folder in folders if circle(children(edges, folder))}
    assert circles == CIRCLES_LEFT


#: Folders with circles between their parts: arrays and kernels of the filters, and the reading of
#: ADS-B files and feeds. No module is in a circle.
CIRCLES_LEFT = {"multiradar.estimation.filters", "multiradar_converters"}


def module_name(path: str) -> str:
    package = next(name for name, folder in PACKAGES.items() if path.startswith(folder))
    inside = PurePosixPath(path).relative_to(PACKAGES[package]).with_suffix("")
    return ".".join([package, *(part for part in inside.parts if part != "__init__")])


def imported(path: str, known: dict[str, str]) -> set[str]:
    found = set()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inside = {f"{node.module}.{alias.name}" for alias in node.names} & known.keys()
            found |= inside if len(inside) == len(node.names) else inside | {node.module}
    return (found & known.keys()) - {module_name(path)}


def children(edges: Graph, folder: str) -> Graph:
    """Return the imports between what a folder shows."""

    def child(name: str) -> str | None:
        if folder and not name.startswith(folder + "."):
            return None
        return ".".join(name.split(".")[: folder.count(".") + 2]) if folder else name.split(".")[0]

    found: Graph = defaultdict(set)
    for name, others in edges.items():
        own = child(name)
        if own is not None:
            found[own] |= {other for other in map(child, others) if other not in (None, own)}
    return found


def circle(edges: Graph) -> list[str]:
    """Return a circle, empty if there is none: what remains when leaves are removed."""
    left = {name: set(others) for name, others in edges.items()}
    while leaves := [name for name, others in left.items() if not others & left.keys()]:
        for name in leaves:
            del left[name]
    return sorted(left)


@pytest.mark.parametrize(
    ("edges", "expected"),
    [
        ({"a": {"b"}, "b": {"c"}, "c": set()}, []),
        ({"a": {"b"}, "b": {"c"}, "c": {"b"}}, ["a", "b", "c"]),
    ],
)
def test_circles_are_found(edges: Graph, expected: list[str]) -> None:
    assert circle(edges) == expected
