"""What `multiradar serve` says once it takes measurements."""

import json
from types import SimpleNamespace

import pytest

from multiradar.cli.serve import _tell


def told(
    capsys: pytest.CaptureFixture[str], asterix: tuple[str, ...], *, as_json: bool = False
) -> str:
    application = SimpleNamespace(
        http_url="http://127.0.0.1:8321",
        zenoh_endpoints=("tcp/127.0.0.1:7447",),
        asterix_endpoints=asterix,
    )
    _tell(application, as_json)  # type: ignore[arg-type]
    return capsys.readouterr().out


def test_listeners_are_told_where_there_are_some(capsys: pytest.CaptureFixture[str]) -> None:
    alone = "multiradar serves http://127.0.0.1:8321 and Zenoh at tcp/127.0.0.1:7447"
    assert told(capsys, ()) == f"{alone}\n"
    heard = told(capsys, ("udp/239.0.0.1:8600", "udp/127.0.0.1:8601"))
    assert heard == (f"{alone}, and listens to ASTERIX at udp/239.0.0.1:8600, udp/127.0.0.1:8601\n")


def test_programs_are_told_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert "asterix" not in json.loads(told(capsys, (), as_json=True))
    heard = json.loads(told(capsys, ("udp/239.0.0.1:8600",), as_json=True))
    assert heard["asterix"] == ["udp/239.0.0.1:8600"]
