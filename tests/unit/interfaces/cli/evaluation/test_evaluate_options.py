"""The options of `evaluate` show the defaults of the settings."""

import dataclasses
import inspect
import re
from typing import get_type_hints

import pytest
from typer.models import OptionInfo

from multiradar.cli.evaluation.evaluate import evaluate
from multiradar.errors import ConfigurationError
from multiradar.evaluation.settings import EvaluationSettings


def test_help_shows_the_defaults_of_the_settings() -> None:
    output = {}
    for hint in get_type_hints(evaluate, include_extras=True).values():
        for option in getattr(hint, "__metadata__", ()):
            if isinstance(option, OptionInfo) and option.metavar == "NUMBER":
                # With Annotated, the flag stands in the place of the default.
                output[option.default] = option.show_default
    known = {
        f"--{re.sub('(_max)?_(m|s)$', '', one.name).replace('_', '-')}": (
            "none" if one.default is None else f"{one.default:g}"
        )
        for one in dataclasses.fields(EvaluationSettings)
        if not isinstance(one.default, bool)
    }
    assert output == known
    assert set(inspect.signature(evaluate).parameters) >= {"partial", "tentative", "strict"}


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_a_time_or_length_that_is_not_positive_is_rejected(value: float) -> None:
    with pytest.raises(ConfigurationError, match="step_s: expected a number above 0"):
        EvaluationSettings(step_s=value)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("age_max_s", 1e9, "from 0.1 to 3 600 s, was 1e+09"),
        ("age_max_s", 1e-6, "from 0.1 to 3 600 s, was 1e-06"),
        ("reference_gap_s", float("inf"), "from 0.1 to 3 600 s, was inf"),
        ("cutoff_m", float("nan"), "from 1 to 1 000 000 m, was nan"),
        ("order", 0.5, "from 1 to 100, was 0.5"),
        ("order", 1e9, "from 1 to 100, was 1e+09"),
        ("density", -1.0, "from 0.0001 to 1 000 000 m²/s³, was -1"),
        ("step_s", 1e9, "above 0 and at most 86 400 s, was 1e+09"),
    ],
)
def test_values_that_no_evaluation_has_are_rejected(name: str, value: float, expected: str) -> None:
    with pytest.raises(ConfigurationError) as raised:
        dataclasses.replace(EvaluationSettings(), **{name: value})  # type: ignore[arg-type]  # floats
    assert str(raised.value) == f"{name}: expected a number {expected}"
