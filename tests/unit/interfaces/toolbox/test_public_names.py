"""The public names, and what it costs to import them."""

import sys

import pytest
from typer.core import TyperGroup as Group
from typer.main import get_command

import multiradar as mr
from multiradar.cli.main import app
from support.paths import ROOT
from support.processes.waiting import run_to_end

NAMES = [
    "Bundle", "Run", "SequentialFilter", "Tracker", "adapters", "convert", "evaluate",
    "load_sensors", "register_filter", "simulate", "study", "track",
]  # fmt: skip


def test_the_public_names_are_these_and_documented() -> None:
    assert mr.__all__ == NAMES
    for name in NAMES:
        assert getattr(mr, name).__doc__, name
        assert name in dir(mr)


def test_the_reference_has_every_public_name() -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    # A module is documented where it is, its functions by its members.
    places = {name: "toolbox.adapters" if name == "adapters" else name for name in NAMES}
    assert [name for name, at in places.items() if f":: multiradar.{at}\n" not in page] == []


def test_another_name_is_an_error() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'trak' .did you mean 'track'.*known: "):
        mr.trak  # noqa: B018
    with pytest.raises(AttributeError, match=r"no attribute '__wrapped__'$"):
        mr.__wrapped__  # noqa: B018


def test_a_command_without_a_function_is_named_as_such() -> None:
    whole = get_command(app)
    assert isinstance(whole, Group)
    commands = {*whole.commands} - {*mr.__all__}
    assert {*mr._COMMANDS} == {one for one in commands if one.isidentifier() and one != "key"}
    for name in ("align", "inspect"):
        with pytest.raises(AttributeError, match=f"it is a command; run `multiradar {name}`"):
            getattr(mr, name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "code",
    [
        "import multiradar",
        "import sys; from multiradar.cli.main import run; run(['--version'])",
        "import sys; from multiradar.cli.main import run; run(['track', '--help'])",
    ],
)
def test_what_is_heavy_is_imported_when_it_is_used(code: str) -> None:
    heavy = "numba", "polars", "matplotlib", "scipy", "zenoh"
    check = f"{code}\nimport sys\nprint('heavy:', sorted(set(sys.modules) & {set(heavy)}))"
    done = run_to_end([sys.executable, "-c", check])
    assert done.stdout.splitlines()[-1] == "heavy: []", done.stdout + done.stderr
