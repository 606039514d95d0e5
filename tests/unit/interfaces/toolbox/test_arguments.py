"""Arguments of another type are errors of this package that name the argument."""

import inspect
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Any, get_args

import numpy as np
import polars as pl
import pytest

import multiradar as mr
from multiradar.errors import ArgumentError, MultiradarError
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.toolbox.arguments import typed
from multiradar.toolbox.conversion.convert import Conversion
from multiradar.toolbox.evaluation.evaluate import Evaluation
from multiradar.toolbox.output import PathLike
from multiradar.toolbox.simulation import Simulation
from support.paths import ROOT

# Right arguments of each public function; the functions stop at the wrong one, before any work.
RIGHT: dict[Callable[..., Any], dict[str, Any]] = {
    mr.track: {"measurements": "x", "sensors": "x"},
    mr.convert: {"recordings": "x", "format": "asterix"},
    mr.evaluate: {"tracks": "x", "truth": "x"},
    mr.simulate: {"scenario": "climbs"},
    mr.study: {"name": "bearing-only"},
    mr.load_sensors: {"path": "x"},
    mr.register_filter: {"name": "own", "make": dict},
    mr.Tracker: {"sensors": ROOT / "examples" / "sensors-vid-sample.toml"},
    mr.Run: {"folder": "x"},
    Conversion: {"folder": "x"},
    Simulation: {"folder": "x"},
    mr.adapters.to_traffic: {"tracks": "x"},
    mr.adapters.from_traffic: {"flights": "x"},
    mr.adapters.from_stone_soup: {"tracks": [], "centre_deg": (46.0, 8.0)},
}


def parameters() -> list[tuple[Callable[..., Any], str]]:
    """Return each argument of each function, options by their declaration."""
    found = []
    for function in RIGHT:
        for name, one in inspect.signature(function).parameters.items():
            declared = get_args(one.annotation)[:1] if one.kind is one.VAR_KEYWORD else ()
            if function is mr.evaluate and declared:
                declared = (EvaluationSettings,)
            names = [*declared[0].__annotations__] if declared else [name]
            found += [(function, name) for name in names]
    return found


@pytest.mark.parametrize(
    ("function", "name"), parameters(), ids=lambda one: getattr(one, "__name__", one)
)
def test_no_argument_may_be_of_another_type(function: Callable[..., Any], name: str) -> None:
    with pytest.raises(MultiradarError, match=rf"\b{name}\b.*expected .*, was "):
        function(**{**RIGHT[function], name: object()})


@pytest.mark.parametrize("method", [mr.Run.table, Conversion.table, mr.Run.plot, Evaluation.plot])
def test_no_argument_of_a_method_may_be_of_another_type(method: Callable[..., Any]) -> None:
    with pytest.raises(ArgumentError, match=r"`names?`: expected .*, was \(?5"):
        method(None, 5)


@typed
def example(
    *,
    number: float | None = None,
    whole: int = 1,
    names: Collection[str] | None = None,
    paths: PathLike | Iterable[PathLike] = "",
    flag: bool = False,
) -> object:
    return next(one for one in (number, names, paths, flag, whole) if one is not None)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"number": "2000"}, "`number`: expected a number, was '2000'"),
        ({"number": True}, "`number`: expected a number, was True"),
        ({"whole": 1.0}, "`whole`: expected a whole number, was 1.0"),
        ({"names": ["imm", 5]}, "`names`: expected names, was ['imm', 5]"),
        ({"names": b"imm"}, "`names`: expected names, was b'imm'"),
        ({"paths": 5}, "`paths`: expected a path or several paths, was 5"),
        ({"flag": 1}, "`flag`: expected True or False, was 1"),
        ({"flag": ["x"] * 99}, "`flag`: expected True or False, was list"),
    ],
)
def test_the_message_states_what_was_expected(given: dict[str, Any], expected: str) -> None:
    with pytest.raises(ArgumentError) as raised:
        example(**given)
    assert str(raised.value) == expected


@pytest.mark.parametrize(
    ("given", "used"),
    [
        ({"number": np.float32(2.0)}, 2.0),
        ({"number": 2}, 2),
        ({"names": "imm"}, ("imm",)),
        ({"names": iter(["imm", "ci"])}, ("imm", "ci")),
        ({"names": {"imm": 1}.keys()}, {"imm"}),
        ({"paths": "a b"}, "a b"),
    ],
)
def test_numbers_and_names_of_any_kind_are_accepted(given: dict[str, Any], used: object) -> None:
    assert example(**given) == used


def test_one_preset_may_be_given_as_text(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="unknown preset 'ed142'"):
        mr.evaluate(tmp_path, truth=tmp_path, presets="ed142")


def test_a_table_is_no_recording_to_convert() -> None:
    with pytest.raises(ArgumentError, match="`recordings`: expected a path or several paths, was"):
        mr.convert(pl.DataFrame({"a": [1] * 100}))  # type: ignore[arg-type]  # the mistake
