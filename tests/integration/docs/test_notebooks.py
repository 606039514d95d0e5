"""The notebooks of the documents run; `make docs` renders them with their outputs."""

import os
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

from support.paths import ROOT
from support.processes.commands import run_forked

NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
_CELL = re.compile(r"^```\{code-cell\}.*?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def cells(notebook: Path) -> list[str]:
    """Return the code of a notebook, cell by cell."""
    return _CELL.findall(notebook.read_text(encoding="utf-8"))


def test_the_notebooks_are_these_and_each_has_pictures() -> None:
    names = [path.stem for path in NOTEBOOKS]
    assert names == ["biases", "filters", "live", "manoeuvres", "scorecard"]
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    for path in NOTEBOOKS:
        assert f"tutorials/{path.stem}\n" in index
        assert re.search(r"plt\.show\(\)|\.plot\(", "".join(cells(path))), path.stem


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_to_its_end(notebook: Path) -> None:
    done = run_forked(run_notebook, str(notebook))
    assert done.returncode == 0, done.stdout + done.stderr


def run_notebook(notebook: str) -> None:
    """Run the cells in a process for them alone, in the folder of the notebook."""
    # Relative paths would lead elsewhere.
    sys.path[:] = map(os.path.abspath, sys.path)
    os.environ |= {"MPLBACKEND": "Agg", "PYTHONPATH": os.pathsep.join(sys.path)}
    os.chdir(Path(notebook).parent)
    module = ModuleType("__main__")
    sys.modules["__main__"] = module
    exec("\n".join(cells(Path(notebook))), module.__dict__)
