"""What holds for all tests: property tests draw the same examples everywhere.

`make fuzz` draws others, by the profile `fuzz`; what it finds is kept as an `@example(...)`.
"""

import gc
import logging
import os
from collections.abc import Iterator

import pytest
import structlog
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

# No test asserts a time. A folder for a test serves all its examples, each of which fills it.
_CHECKS = (HealthCheck.too_slow, HealthCheck.function_scoped_fixture)
settings.register_profile(
    "same", derandomize=True, database=None, deadline=None, suppress_health_check=_CHECKS
)
settings.register_profile(
    "fuzz", derandomize=False, database=None, deadline=None, suppress_health_check=_CHECKS
)
settings.load_profile("same")

# The matrices of the tests are small: threads of the linear algebra that wait for each other took
# three times the processor time. Read once, when numpy is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Hypothesis also draws constants found in the modules loaded so far, which depend on the tests that
# ran before in the same process.
providers._get_local_constants = lambda: providers._local_constants

# Modules and tests are kept to the end: to search them for garbage took a third of the time of
# collecting tests, and half a second every few tests.
_COLLECTION_THRESHOLD = 50_000
gc.disable()


def pytest_collection_finish() -> None:
    """Collect garbage again, of what tests make."""
    gc.freeze()
    gc.set_threshold(_COLLECTION_THRESHOLD)
    gc.enable()


@pytest.fixture(autouse=True)
def _logs_as_before() -> Iterator[None]:
    # A log that one test configures would write to the closed standard error of another.
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    if root.handlers != handlers:
        root.handlers[:] = handlers
        root.setLevel(level)
        structlog.reset_defaults()
