"""The import contracts hold, and detect violations."""

import sys
import tomllib

from support.paths import ROOT
from support.processes.waiting import run_to_end

CODE = ("service/multiradar", "converters/multiradar_converters", "schemas/multiradar_schemas")


def test_imports_run_downwards_only() -> None:
    run = run_to_end(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()"],
        cwd=ROOT,
    )
    assert run.returncode == 0, run.stdout[-4000:]
    assert "0 broken" in run.stdout


def test_every_folder_of_the_service_stands_in_the_contract() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contract = next(
        contract
        for contract in settings["tool"]["importlinter"]["contracts"]
        if contract.get("containers") == ["multiradar"]
    )
    named = {part.strip(" ()") for layer in contract["layers"] for part in layer.split("|")}
    folders = {path.parent.name for path in (ROOT / CODE[0]).glob("*/__init__.py")}
    assert contract["exhaustive"]
    assert folders <= named


def test_every_package_is_typed() -> None:
    assert [folder for folder in CODE if not (ROOT / folder / "py.typed").is_file()] == []
