"""Biases of radars whose ranges are refracted, with and without the factor in the sensors file."""

import json
import re
from pathlib import Path

import pytest

from multiradar.cli.main import EXIT_DONE, run

OFFSET_M = {"west": 90.0, "east": -60.0}
SCENE = """
duration_s = 600
seed = 5
[plane]
latitude_deg = 47.0
longitude_deg = 8.0
[[traffic]]
count = 25
east_m = [-250e3, 250e3]
north_m = [-300e3, 300e3]
height_m = [9000, 12000]
speed_mps = [200, 260]
""" + "".join(
    f"""
[[sensor]]
id = "{name}"
east_m = {east_m}
north_m = 0
height_m = 500
rotation_period_s = 10
range_sigma_m = 30
azimuth_sigma_deg = 0.03
range_max_m = 400e3
earth_radius_factor = 1.2
bias.range_offset_m = {OFFSET_M[name]}
bias.azimuth_offset_deg = 0.1
"""
    for name, east_m in (("west", -150e3), ("east", 150e3))
)


def test_the_factor_removes_the_error_of_the_range_offsets(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    scene = tmp_path / "scene"
    assert run(["simulate", str(tmp_path / "scene.toml"), "--out", str(scene)]) == EXIT_DONE
    text = (scene / "sensors.toml").read_text()
    worst = {}
    for name, sensors in (("with", text), ("without", re.sub("earth_radius_factor.*", "", text))):
        (tmp_path / f"{name}.toml").write_text(sensors)
        command = ["track", str(scene), "--sensors", str(tmp_path / f"{name}.toml")]
        assert run([*command, "--out", str(tmp_path / name)]) == EXIT_DONE
        report = json.loads((tmp_path / name / "report.json").read_text())
        found = report["figures"]["final_biases"]
        errors = {one: found[one]["range_offset_m"] for one in OFFSET_M}
        worst[name] = max(abs(errors[one]["estimate"] - OFFSET_M[one]) for one in OFFSET_M)
        capsys.readouterr()
        command = ["evaluate", str(tmp_path / name), "--truth", str(scene), "--json"]
        assert run(command) == EXIT_DONE
        differences = json.loads(capsys.readouterr().out)["differences"]
        if name == "with":
            of_ranges = [one for one in differences if one["quantity"] == "range_m"]
            for one in of_ranges:
                assert abs(one["mean"] - OFFSET_M[one["sensor_id"]]) < 4.0 * one["sigma"]
    assert worst["with"] < 8.0
    assert worst["without"] > 12.0
