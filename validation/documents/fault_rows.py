"""Rows of the fault model, and the tests that show what happens."""

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "docs" / "validation" / "faults.md"
ROWS = range(1, 43)


@cache
def marked() -> dict[int, tuple[str, ...]]:
    """Return, for each row, the tests marked with it, as `FILE::NAME`, sorted."""
    found: dict[int, list[str]] = defaultdict(list)
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        if "pytest.mark.fault" not in text:
            continue
        for one in ast.walk(ast.parse(text)):
            if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef):
                for row in _rows(one):
                    found[row].append(f"{path.relative_to(ROOT)}::{one.name}")
    return {row: tuple(sorted(tests)) for row, tests in sorted(found.items())}


def files(tests: tuple[str, ...]) -> tuple[str, ...]:
    """Return the files of tests, each once, in their order."""
    return tuple(dict.fromkeys(one.partition("::")[0] for one in tests))


def _rows(function: ast.FunctionDef | ast.AsyncFunctionDef) -> list[int]:
    return [
        int(ast.literal_eval(row))
        for mark in function.decorator_list
        if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.fault"
        for row in mark.args
    ]
