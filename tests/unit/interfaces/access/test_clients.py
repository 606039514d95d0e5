"""Keys, the file of clients, and how it is read again."""

import os
from math import inf
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from multiradar.access.attempts import RETAINED_MAX, WITHIN_S, WRONG_MAX, Attempts
from multiradar.access.authentication import (
    Authentication,
    ClientCertificate,
    with_default_file,
)
from multiradar.access.clients import add_client, key_digest, new_key, read_clients
from multiradar.clock import FixedClock
from multiradar.errors import ConfigurationError, RequestError
from multiradar.settings.access import AccessSettings, ClientSettings, Role
from support.access import authentication, clients


def client(name: str, key: str, role: Role = Role.DISPLAY) -> ClientSettings:
    return ClientSettings(name=name, role=role, key_sha256=key_digest(key))


def test_keys_are_random_and_only_their_digest_is_written(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    first, second = new_key(), new_key()
    assert first != second
    # 32 octets in base64 without padding.
    assert len(first) == len("mr_") + 43
    bound = ClientSettings(
        name="radar", role=Role.FEED, sensors=("26-10",), key_sha256=key_digest(first)
    )
    add_client(file, bound)
    add_client(file, client("screen", second, Role.DISPLAY))
    assert read_clients(file).client == (bound, client("screen", second))
    text = file.read_text()
    assert first not in text
    assert second not in text
    assert list(tmp_path.iterdir()) == [file]


def test_a_name_is_added_once(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    add_client(file, client("screen", new_key()))
    before = file.read_bytes()
    with pytest.raises(
        ConfigurationError, match="client screen already exists; choose another name"
    ):
        add_client(file, client("screen", new_key()))
    assert file.read_bytes() == before


def test_a_changed_file_keeps_owner_and_mode(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    add_client(file, client("screen", new_key()))
    file.chmod(0o644)
    if os.geteuid() == 0:
        os.chown(file, 10_001, 10_001)
    before = file.stat()
    mask = os.umask(0o077)
    try:
        add_client(file, client("other", new_key()))
    finally:
        os.umask(mask)
    after = file.stat()
    assert after.st_ino != before.st_ino
    assert (after.st_mode, after.st_uid, after.st_gid) == (
        before.st_mode, before.st_uid, before.st_gid,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('[[client]]\nname = "a b"\nrole = "feed"', "line 2"),
        ('[[client]]\nname = "a"\nrole = "admin"', "expected .*feed"),
        ('[[client]]\nname = "a"\nrole = "display"\nsensors = ["1"]', "to the role feed only"),
        ('[[client]]\nname = "a"\nrole = "feed"\nsensors = []', "sensors: expected at least one"),
        ('[[client]]\nname = "a"\nrole = "feed"\nkey_sha256 = "secret"', "key_sha256"),
        ('[[client]]\nname = "a"\nrole = "feed"\nkey = "mr_"', "key"),
        ('[[client]]\nname = "a"\nrole = "feed"\n' * 2, "each name once, found a 2 times"),
        ("[[client]", "not valid TOML"),
    ],
)
def test_mistakes_in_the_file_are_named(tmp_path: Path, text: str, reason: str) -> None:
    file = tmp_path / "keys.toml"
    file.write_text(text)
    with pytest.raises(ConfigurationError, match=reason):
        authentication(file)


def test_a_client_of_the_settings_is_not_in_the_file_too(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    add_client(file, client("screen", new_key()))
    settings = AccessSettings(clients=(client("screen", new_key()),), keys_file=file)
    with pytest.raises(ConfigurationError, match="each name once, found screen 2 times"):
        Authentication(settings)


@pytest.mark.fault(38)
def test_a_revoked_key_and_a_new_one_count_from_the_next_request_on(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    old, new = new_key(), new_key()
    add_client(file, client("old", old))
    found = authentication(file)
    caller = found.caller(old, None)
    assert found.is_current(caller)
    with capture_logs() as logs:
        file.unlink()
        add_client(file, client("new", new))
        with pytest.raises(RequestError, match="not valid"):
            found.caller(old, None)
        assert found.caller(new, None).name == "new"
    assert not found.is_current(caller)
    assert [(one["event"], one["added"], one["removed"]) for one in logs] == [
        ("clients_changed", ["new"], ["old"])
    ]


def test_a_replaced_key_ends_what_the_old_one_began(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    stolen, new = new_key(), new_key()
    add_client(file, client("screen", stolen))
    found = authentication(file)
    thief = found.caller(stolen, None)
    certified = found.caller(None, ClientCertificate("screen", inf))
    file.write_text(file.read_text().replace(key_digest(stolen), key_digest(new)))
    assert not found.is_current(thief)
    assert found.is_current(found.caller(new, None))
    # The certificate is still valid.
    assert found.is_current(certified)


def test_a_certificate_ends() -> None:
    clock = FixedClock()
    found = authentication(clock=clock)
    certificate = ClientCertificate("display", clock.now_s() + 10.0)
    caller = found.caller(None, certificate)
    clock.advance(9.0)
    assert found.is_current(caller)
    clock.advance(1.0)
    assert not found.is_current(caller)
    # Nor does a request on an open connection.
    with pytest.raises(RequestError, match="not valid"):
        found.caller(None, certificate)


def test_a_file_that_cannot_be_read_changes_nothing_and_is_logged_once(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    key = new_key()
    add_client(file, client("screen", key))
    found = authentication(file)
    with capture_logs() as logs:
        file.write_text("[[client]")
        assert found.caller(key, None).name == "screen"
        assert found.caller(key, None).name == "screen"
    assert [one["event"] for one in logs] == ["file_not_read"]


def test_a_certificate_proves_a_name_and_a_wrong_key_is_not_replaced_by_it() -> None:
    found = authentication()
    assert found.caller(None, ClientCertificate("display", inf)).roles == {Role.DISPLAY}
    with pytest.raises(RequestError):
        found.caller("mr_wrong", ClientCertificate("display", inf))
    with pytest.raises(RequestError):
        found.caller(None, ClientCertificate("stranger", inf))


def test_keys_toml_is_used_if_there_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert not Authentication(with_default_file(AccessSettings())).required
    add_client(Path("keys.toml"), client("screen", new_key()))
    assert Authentication(with_default_file(AccessSettings())).required


def test_an_authority_without_clients_would_admit_no_client(tmp_path: Path) -> None:
    settings = AccessSettings(
        certificate=tmp_path / "a", private_key=tmp_path / "b", client_authority=tmp_path / "c"
    )
    with pytest.raises(ConfigurationError, match="client_authority: no clients"):
        Authentication(settings)


def test_rejections_of_an_address_are_logged_once_a_second_with_their_number() -> None:
    clock = FixedClock()
    events = authentication(clock=clock).events
    with capture_logs() as logs:
        for _ in range(100):
            events.warn("rejected", "192.0.2.1", code="CREDENTIALS_INVALID")
        events.warn("rejected", "192.0.2.2", code="CREDENTIALS_INVALID")
        clock.advance(1.0)
        events.warn("rejected", "192.0.2.1", code="CREDENTIALS_INVALID")
    assert [(one["origin"], one["unlogged"]) for one in logs] == [
        ("192.0.2.1", 0),
        ("192.0.2.2", 0),
        ("192.0.2.1", 99),
    ]


@pytest.mark.fault(38)
def test_a_client_with_many_wrong_keys_is_asked_to_pause() -> None:
    clock = FixedClock()
    attempts = Attempts(clock)
    for _ in range(WRONG_MAX):
        attempts.note_wrong("192.0.2.1")
    with pytest.raises(RequestError, match="invalid keys") as error:
        attempts.note_wrong("192.0.2.1")
    assert (error.value.status, error.value.headers) == (429, {"retry-after": "61"})
    attempts.note_wrong("192.0.2.2")
    clock.advance(WITHIN_S)
    attempts.note_wrong("192.0.2.1")
    for number in range(2 * RETAINED_MAX):
        attempts.note_wrong(str(number))
    assert len(attempts._wrong) == RETAINED_MAX


def test_every_client_has_one_role() -> None:
    for one in clients():
        caller = authentication().clients.by_name(one.name)
        assert caller is not None
        may = {role for role in Role if caller.may(role)}
        assert may == (set(Role) if one.role is Role.OPERATE else {one.role})
