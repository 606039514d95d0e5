"""`serve` is killed right after sensors change over HTTP: the output is that without a kill."""

from pathlib import Path
from typing import Any

from multiradar.ingest.replay.http import MEDIA_TYPES, Encoding, encode
from multiradar_schemas.measurements.columns import complete
from support.processes import clients
from support.processes.served import SENSORS, Served
from support.scenarios.live_scene import cut, recording

PARTS = cut(recording(600), [150] * 3)
#: Before each part but the first: a sensor, what changes, and whether its biases are reset.
CHANGES: list[tuple[str, dict[str, Any], str]] = [
    ("41-20", {"enabled": False}, "false"),
    ("41-20", {"enabled": True, "range_sigma_m": 80.0, "longitude_deg": 16.5001}, "false"),
    ("41-10", {"range_max_m": 400_000.0}, "true"),
]


def _change(served: Served, sensor: str, values: dict[str, Any], reset: str) -> dict[str, Any]:
    url = f"{served.url}/v1/sensors/{sensor}"
    with clients.client(served.url) as client:
        described = client.get(f"{url}/configuration").raise_for_status().json()
        answer = client.put(f"{url}?reset_biases={reset}", json=described | values)
        made: dict[str, Any] = answer.raise_for_status().json()
    return made


def _send(served: Served, number: int) -> list[str]:
    encoding = Encoding.ARROW
    body = encode(complete(PARTS[number]), encoding)
    with clients.client(served.url) as client:
        headers = {"content-type": MEDIA_TYPES[encoding], "idempotency-key": f"part {number}"}
        url = f"{served.url}/v1/measurements"
        answer = client.post(url, content=body, headers=headers).raise_for_status().json()
    return [row["code"] for row in answer["rejected"]]


def _end(served: Served) -> dict[str, Any]:
    with clients.client(served.url) as client:
        client.post(f"{served.url}/v1/flush").raise_for_status()
    status = served.status()
    names = ("output_sha256", "output_sequence", "accepted", "rejected", "rejected_by_code")
    return {name: status[name] for name in names}


def test_a_kill_right_after_a_change_loses_nothing(tmp_path: Path) -> None:
    sensors = tmp_path / "sensors.toml"
    sensors.write_text(SENSORS)
    undisturbed = Served(sensors, tmp_path / "undisturbed")
    killed = Served(sensors, tmp_path / "killed")
    for number in range(len(PARTS)):
        if number:
            made = [_change(one, *CHANGES[number - 1]) for one in (undisturbed, killed)]
            assert made[0] == made[1]
            assert made[0]["applied"]
            killed.kill()
            killed = Served(sensors, tmp_path / "killed")
        codes = [_send(one, number) for one in (undisturbed, killed)]
        assert codes[0] == codes[1]
        assert set(codes[0]) == ({"SENSOR_DISABLED"} if number == 1 else set())
    warnings = killed.status()["warnings"]
    assert not any("disabled" in one for one in warnings)
    expected = _end(undisturbed)
    assert _end(killed) == expected
    assert expected["rejected_by_code"]["SENSOR_DISABLED"] > 0
    assert undisturbed.stop() == 0
    assert killed.stop() == 0
    # From the whole journal, without the snapshot of the clean stop.
    for one in (tmp_path / "killed" / "journal.sqlite-snapshots").glob("*"):
        one.unlink()
    again = Served(sensors, tmp_path / "killed")
    assert again.status()["output_sha256"] == expected["output_sha256"]
    assert again.stop() == 0
