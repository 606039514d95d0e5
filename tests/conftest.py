"""What holds for all tests: property tests draw the same examples everywhere.

`make fuzz` draws others, by the profile `fuzz`; what it finds is kept as an `@example(...)`.
"""

import gc
import logging
import os
import shutil
from collections.abc import Generator, Iterator
from itertools import chain
from pathlib import Path

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

# Histories of a service are large arrays, of which a test fills a few rows: with huge pages the
# first row of each cleared 2 MiB, a third of the time of a start.
os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")

# What commands print reaches a pipe only if they flush it, as it does for users.
os.environ.pop("PYTHONUNBUFFERED", None)

# Hypothesis also draws constants found in the modules loaded so far, which depend on the tests that
# ran before in the same process.
providers._get_local_constants = lambda: providers._local_constants

# Modules and tests are kept to the end: to search them for garbage took a third of the time of
# collecting tests, and half a second every few tests.
_COLLECTION_THRESHOLD = 50_000
gc.disable()


# Journals wait for the disk with every message; in memory they do not. What a disk does to them is
# tested by disks that fail. Folders of tests that passed are removed.
_MEMORY = Path("/dev/shm")
_MEMORY_FREE_MIN = 4 * 2**30
if _MEMORY.is_dir() and shutil.disk_usage(_MEMORY).free >= _MEMORY_FREE_MIN:
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(_MEMORY))

#: Growth of a process since the last collection of garbage after which it is collected again.
_GROWTH_MAX = 200 * 2**20
_collected_at = 0


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let each worker begin with modules of long tests: late ones would leave a core idle."""
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    modules: dict[Path, list[pytest.Item]] = {}
    for item in items:
        modules.setdefault(item.path, []).append(item)
    long = [path for path in modules if "integration" in path.parts]
    rest = [item for path, own in modules.items() if path not in long for item in own]
    parts = [
        [item for path in long[first::workers] for item in modules[path]]
        for first in range(workers)
    ]
    left = len(items)
    # As many for each as it is given at the start.
    for number, part in enumerate(parts):
        more = max(left // (workers - number) - len(part), 0)
        part += rest[:more]
        del rest[:more]
        left -= len(part)
    items[:] = [*chain.from_iterable(parts), *rest]


def pytest_collection_finish() -> None:
    """Collect garbage again, of what tests make."""
    gc.freeze()
    gc.set_threshold(_COLLECTION_THRESHOLD)
    gc.enable()


def pytest_unconfigure() -> None:
    """Let nothing be searched for garbage when the process ends: it took up to ten seconds."""
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Drop what a passed test wrote and logged, which is kept to the end otherwise."""
    report = yield
    if report.passed:
        report.sections.clear()
    if call.when == "teardown":
        item._report_sections.clear()
        _collect_garbage()
    return report


# Services and engines are large, few in objects, and in cycles: counts of objects do not show them.
def _collect_garbage() -> None:
    global _collected_at
    if _resident() > _collected_at + _GROWTH_MAX:
        gc.collect()
        _collected_at = _resident()


def _resident() -> int:
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[1]
    return int(pages) * os.sysconf("SC_PAGE_SIZE")


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
