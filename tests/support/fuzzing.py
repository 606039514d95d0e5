"""Draw new examples for all property tests until a budget of time is used up: `make fuzz`.

Every round runs the property tests in an order and with examples given by its seed, in a process
of its own, in which this module is a plugin of pytest.
"""

import argparse
import random
import secrets
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from support.paths import TESTS
from support.processes.waiting import WAIT_TIMEOUT_S

#: Rounds use consecutive seeds; a round with a failure prints its seed.
SEED_MAX = 2**32


def fuzz(
    folder: Path, seconds: float, seed: int, clock: Callable[[], float] = time.monotonic
) -> int:
    """Run rounds until the time is used up or a failure is found; return the exit status."""
    end_s = clock() + seconds
    while (left_s := end_s - clock()) > 0.0:
        sys.stdout.write(f"seed {seed}, {left_s:.0f} s left\n")
        sys.stdout.flush()
        command = [sys.executable, "-m", "pytest", "-p", "support.fuzzing", "-m", "hypothesis",
                   "-q", "--hypothesis-profile=fuzz", f"--hypothesis-seed={seed}",
                   f"--fuzz-seconds={left_s}", *_files(folder)]  # fmt: skip
        status = subprocess.run(command, cwd=TESTS, check=False, timeout=WAIT_TIMEOUT_S).returncode
        if status != pytest.ExitCode.OK:
            return status
        seed += 1
    return 0


def _files(folder: Path) -> list[str]:
    files = sorted(folder.rglob("test_*.py"))
    return [str(file) for file in files if "hypothesis" in file.read_text(encoding="utf-8")]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Set the time limit of a round."""
    parser.addoption("--fuzz-seconds", type=float, help="begin no test after so many seconds")


class _Round:
    def __init__(self, seed: int, end_s: float) -> None:
        self._seed, self._end_s = seed, end_s

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        # Over several rounds a short budget reaches every test.
        random.Random(self._seed).shuffle(items)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self) -> bool | None:
        return True if time.monotonic() > self._end_s else None

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        for report in terminalreporter.stats.get("failed", ()):
            terminalreporter.write_line(
                f"to repeat: pytest --hypothesis-profile=fuzz --hypothesis-seed={self._seed} "
                f"'{report.nodeid}'; keep the falsifying example as @example(...)"
            )


def pytest_configure(config: pytest.Config) -> None:
    """Enforce the time limit of a round."""
    end_s = time.monotonic() + config.getoption("--fuzz-seconds")
    seed = int(config.getoption("--hypothesis-seed"))
    config.pluginmanager.register(_Round(seed, end_s))


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(description="Draw new examples for all property tests.")
    parser.add_argument("--seconds", type=float, required=True, help="budget of time")
    parser.add_argument("--seed", type=int, help="of the first round (default: random)")
    given = parser.parse_args()
    seed = secrets.randbelow(SEED_MAX) if given.seed is None else given.seed
    return fuzz(TESTS, given.seconds, seed)


if __name__ == "__main__":
    sys.exit(main())
