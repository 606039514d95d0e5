"""Radars without a scan period in the sensors file are named, with the period of their plots."""

import re
import tomllib
from pathlib import Path

import pytest

from multiradar.cli.main import run


def _track(*arguments: object) -> int:
    return run(["track", *map(str, arguments)])


def test_a_missing_scan_period_is_named_with_the_one_of_the_plots(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = tmp_path / "made"
    assert run(["simulate", "rotating-gaps", "--duration", "200", "--out", str(made)]) == 0
    text = (made / "sensors.toml").read_text(encoding="utf-8")
    lines = text.splitlines()
    periods = [line for line in lines if line.startswith("rotation_period_s")]
    (made / "none.toml").write_text(
        "\n".join(line for line in lines if line not in periods), encoding="utf-8"
    )
    capsys.readouterr()
    assert _track(made, "--sensors", made / "sensors.toml", "--out", tmp_path / "right") == 0
    assert "rotation_period_s" not in capsys.readouterr().err
    assert _track(made, "--sensors", made / "none.toml", "--out", tmp_path / "none") == 0
    error = capsys.readouterr().err
    found = re.findall(r"(\S+): rotation_period_s is missing .* from the plots: (\S+) s", error)
    sensors = tomllib.loads(text)["sensor"]
    true_s = {one["id"]: one["rotation_period_s"] for one in sensors}
    shown_s = {name.removeprefix("multiradar: "): float(shown) for name, shown in found}
    assert shown_s == pytest.approx(true_s, rel=3e-3)
