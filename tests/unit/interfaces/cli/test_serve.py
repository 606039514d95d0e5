"""The line that `multiradar serve` prints when it is ready."""

import json
from types import SimpleNamespace

import pytest

from multiradar.cli.serve import _print_addresses


def ready_line(
    capsys: pytest.CaptureFixture[str],
    asterix: tuple[str, ...],
    *,
    as_json: bool = False,
    feeds: tuple[str, ...] = (),
) -> str:
    application = SimpleNamespace(
        http_url="http://127.0.0.1:8321",
        zenoh_endpoints=("tcp/127.0.0.1:7447",),
        asterix_endpoints=asterix,
        feed_endpoints=feeds,
    )
    _print_addresses(application, as_json)  # type: ignore[arg-type]
    return capsys.readouterr().out


def test_asterix_listeners_are_reported(capsys: pytest.CaptureFixture[str]) -> None:
    alone = "multiradar serves http://127.0.0.1:8321 and Zenoh at tcp/127.0.0.1:7447"
    assert ready_line(capsys, ()) == f"{alone}\n"
    line = ready_line(capsys, ("udp/239.0.0.1:8600", "udp/127.0.0.1:8601"))
    assert line == (f"{alone}, receives ASTERIX on udp/239.0.0.1:8600, udp/127.0.0.1:8601\n")


def test_asterix_listeners_are_reported_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert "asterix" not in json.loads(ready_line(capsys, (), as_json=True))
    line = json.loads(ready_line(capsys, ("udp/239.0.0.1:8600",), as_json=True))
    assert line["asterix"] == ["udp/239.0.0.1:8600"]


def test_feeds_are_reported(capsys: pytest.CaptureFixture[str]) -> None:
    line = ready_line(capsys, (), feeds=("tcp/127.0.0.1:30047",))
    assert line.endswith(", and receives feeds from tcp/127.0.0.1:30047\n")
    found = json.loads(ready_line(capsys, (), as_json=True, feeds=("tcp/127.0.0.1:30047",)))
    assert found["feeds"] == ["tcp/127.0.0.1:30047"]
