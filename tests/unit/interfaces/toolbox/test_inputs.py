"""Inputs that can be read, but not used."""

import os
from pathlib import Path

import pytest

from multiradar.cli.terminal.view_hint import view_hint
from multiradar.clock import SystemClock
from multiradar.errors import ConfigurationError
from multiradar.toolbox.inputs import as_sensors_file, in_future


def test_sensors_from_a_pipe_are_an_error_before_the_work(tmp_path: Path) -> None:
    """Regression: a run ended without its output, because a pipe cannot be read again."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with (
        pytest.raises(ConfigurationError, match="expected a file, was a pipe or a device"),
        as_sensors_file(pipe),
    ):
        pass


@pytest.mark.parametrize(
    ("later_s", "found"), [(-86_400.0, False), (3600.0, False), (4e9, True), (1e14, False)]
)
def test_times_in_the_future_are_named(later_s: float, *, found: bool) -> None:
    last_s = SystemClock().now_s() + later_s
    assert bool(in_future((0.0, last_s))) == found
    assert not in_future(None)


def test_a_folder_that_begins_with_a_dash_can_be_viewed() -> None:
    assert view_hint(Path("-out")) == "to show this on a map: multiradar view ./-out"
