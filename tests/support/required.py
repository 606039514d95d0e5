"""What tests need beyond the package: without it they are skipped, or fail where it is required."""

import os
from typing import NoReturn

import pytest


def skip_unless_required(name: str, reason: str) -> NoReturn:
    """Skip a test that cannot run here; with `TEST_<NAME>_REQUIRED` set, let it fail.

    Parameters
    ----------
    name : str
        What is missing, one word.
    reason : str
        Why the test cannot run.
    """
    variable = f"TEST_{name.upper()}_REQUIRED"
    if os.environ.get(variable):
        pytest.fail(f"{reason}; required here ({variable})")
    pytest.skip(f"{name} test not run: {reason}")
