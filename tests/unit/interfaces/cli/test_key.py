"""`multiradar key`: the key is shown once, its hash is kept."""

from pathlib import Path

import pytest

from multiradar.access.clients import key_digest, read_clients
from multiradar.cli.main import run
from multiradar.settings.access import Role


def test_a_key_is_shown_and_its_client_added(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "keys.toml"
    options = ["--role", "feed", "--sensors", "26-10,35-10", "--file", str(file)]
    assert run(["key", "radars", *options]) == 0
    shown = capsys.readouterr()
    key = shown.out.strip()
    (client,) = read_clients(file).client
    assert (client.name, client.role, client.sensors) == ("radars", Role.FEED, ("26-10", "35-10"))
    assert client.key_sha256 == key_digest(key)
    assert key not in shown.err
    assert "added radars with the role feed" in shown.err


@pytest.mark.parametrize(
    ("arguments", "status", "reason"),
    [
        (["a b", "--role", "feed"], 1, "name"),
        (["a", "--role", "display", "--sensors", "1-1"], 1, "sensors apply to the role feed only"),
        (["a", "--role", "feed", "--sensors", "../x"], 1, "sensors"),
        (["a", "--role", "admin"], 2, "admin"),
        (["a"], 2, "role"),
    ],
)
def test_mistakes_add_nothing(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    status: int,
    reason: str,
) -> None:
    file = tmp_path / "keys.toml"
    assert run(["key", *arguments, "--file", str(file)]) == status
    assert reason in capsys.readouterr().err
    assert not file.exists()
