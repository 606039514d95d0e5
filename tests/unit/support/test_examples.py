"""Property tests draw the same examples everywhere."""

import importlib.util
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

DRAWN: list[object] = []


@settings(max_examples=200)
@given(st.integers() | st.text() | st.floats())
def draw(value: object) -> None:
    DRAWN.append(repr(value))


def drawn() -> list[object]:
    DRAWN.clear()
    draw()
    return DRAWN.copy()


@pytest.mark.slow
def test_examples_do_not_depend_on_the_run_or_on_what_is_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = drawn()
    assert len(set(before)) > 100
    numbers = ", ".join(str(12345678901 + k) for k in range(100))
    source = tmp_path / "of_the_project.py"
    source.write_text(f"NUMBERS = [{numbers}]\n")
    spec = importlib.util.spec_from_file_location("of_the_project", source)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setitem(sys.modules, "of_the_project", module)
    assert drawn() == before
