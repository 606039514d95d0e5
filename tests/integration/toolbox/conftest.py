"""One small scenario and its tracks, made by the commands, for all tests of the functions."""

from pathlib import Path

import pytest

import multiradar as mr
from multiradar.cli.main import EXIT_DONE, run

SCENARIO, DURATION_S = "one-radar-adsb", 120.0


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Outputs of the commands: `scene` of `simulate`, `tracks` of `track`."""
    folder = tmp_path_factory.mktemp("commands")
    scene, tracks = folder / "scene", folder / "tracks"
    options = ["--duration", str(DURATION_S), "--out", str(scene)]
    assert run(["simulate", SCENARIO, *options]) == EXIT_DONE
    options = ["--sensors", str(scene / "sensors.toml"), "--out", str(tracks)]
    assert run(["track", str(scene), *options]) == EXIT_DONE
    return folder


@pytest.fixture(scope="session")
def tracked(made: Path) -> mr.Run:
    """The output of `track`."""
    return mr.Run(made / "tracks")
