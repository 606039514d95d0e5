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
