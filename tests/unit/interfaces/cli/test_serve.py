"""The line that `multiradar serve` prints when it is ready, and errors before its start."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from multiradar.cli.serve import _print_addresses
from support.processes.waiting import run_to_end


def ready_line(
    capsys: pytest.CaptureFixture[str],
    asterix: tuple[str, ...],
    *,
    as_json: bool = False,
    feeds: tuple[str, ...] = (),
    following: bool = False,
) -> str:
    application = SimpleNamespace(
        http_url="http://127.0.0.1:8321",
        zenoh_endpoints=("tcp/127.0.0.1:7447",),
        asterix_endpoints=asterix,
        feed_endpoints=feeds,
        following=following,
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


def test_a_standby_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert ready_line(capsys, (), following=True) == (
        "multiradar is the standby and follows the primary; read-only at http://127.0.0.1:8321\n"
    )
    assert json.loads(ready_line(capsys, (), as_json=True, following=True))["role"] == "standby"
    assert "role" not in json.loads(ready_line(capsys, (), as_json=True))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--host", "0.0.0.0"), "no client has a key"),  # rejected
        (("--state", "/proc/x"), "cannot create this folder for the journal"),
        (("--sensors", "absent.toml"), "absent.toml: no such file"),
    ],
)
def test_a_start_that_cannot_succeed_imports_no_kernels(
    options: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    (tmp_path / "sensors.toml").write_text('[[sensor]]\nid = "a"\nkind = "adsb"\n')
    given = {"--sensors": "sensors.toml", "--state": "state"} | {options[0]: options[1]}
    arguments = ["serve", *(one for pair in given.items() for one in pair), "--no-zenoh"]
    code = (
        f"import sys; from multiradar.cli.main import run; status = run({arguments!r}); "
        "sys.exit(status if 'numba' not in sys.modules else 99)"
    )
    done = run_to_end([sys.executable, "-c", code], cwd=tmp_path)
    assert words in done.stderr
    assert done.returncode == 1
