"""The clients of a service: keys, the file of clients, and what each may do."""

import hashlib
import os
import secrets
import stat
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path

from pydantic_core import PydanticCustomError

from multiradar.access.security_log import SECURITY_LOG
from multiradar.access.watched import Watched
from multiradar.errors import ConfigurationError
from multiradar.settings.access import ClientList, ClientSettings, Role, require_each_once
from multiradar_schemas.documents.files import read_toml, validated
from multiradar_schemas.errors import DocumentError

#: Read if there is one and the settings name no other.
DEFAULT_FILE = Path("keys.toml")
#: Begins every key, so that a scanner for secrets can find one.
KEY_PREFIX = "mr_"
#: Octets of randomness in a key.
_KEY_OCTETS = 32


@dataclass(frozen=True, slots=True)
class Caller:
    """Who sent a request.

    Attributes
    ----------
    name : str
        Its name; empty where the service has no credentials.
    roles : frozenset of Role
        What it may do.
    sensors : frozenset of str, optional
        The only sensors whose measurements it may send; None for all.
    until_s : float
        End of its credentials, Unix time, s.
    key_sha256 : str, optional
        SHA-256 of the key that it sent; None for a token or a certificate.
    """

    name: str
    roles: frozenset[Role]
    sensors: frozenset[str] | None = None
    until_s: float = inf
    key_sha256: str | None = field(default=None, repr=False)

    def may(self, role: Role) -> bool:
        """Return whether it may do what this role may."""
        return role in self.roles or Role.OPERATE in self.roles


#: Every caller of a service without credentials.
ANYONE = Caller("", frozenset(Role))


def caller_of(client: ClientSettings) -> Caller:
    """Return a client as a caller, without the proof of its name."""
    return Caller(client.name, frozenset({client.role}), frozenset(client.sensors) or None)


def new_key() -> str:
    """Return a new API key, 256 random bits."""
    return KEY_PREFIX + secrets.token_urlsafe(_KEY_OCTETS)


def key_digest(key: str) -> str:
    """Return the form in which a key is stored: its SHA-256, hexadecimal.

    A key of 256 random bits cannot be guessed from a fast digest; a slow one would only cost time
    for each request.
    """
    return hashlib.sha256(key.encode()).hexdigest()


class Clients:
    """The clients by key and by name.

    Parameters
    ----------
    listed : sequence of ClientSettings
        Clients of the settings.
    file : Path, optional
        File of further clients; it is read again when it changes.

    Raises
    ------
    ConfigurationError
        If the file cannot be used, or repeats a client.
    """

    def __init__(self, listed: Sequence[ClientSettings], file: Path | None) -> None:
        self._listed = tuple(listed)
        self._file = None if file is None else Watched(file, self._read, "clients")
        self.all = self._listed if self._file is None else self._file.current()
        self._index()

    def by_key(self, key: str) -> Caller | None:
        """Return the caller with an API key."""
        return self.by_digest(key_digest(key))

    def by_digest(self, key_sha256: str) -> Caller | None:
        """Return the caller whose API key has this SHA-256."""
        self._refresh()
        return self._by_key.get(key_sha256)

    def by_name(self, name: str) -> Caller | None:
        """Return the caller with a name."""
        self._refresh()
        return self._by_name.get(name)

    def _refresh(self) -> None:
        current = self.all if self._file is None else self._file.current()
        if current is self.all:
            return
        before, self.all = set(self.all), current
        self._index()
        SECURITY_LOG.warning(
            "clients_changed",
            added=sorted(one.name for one in set(current) - before),
            removed=sorted(one.name for one in before - set(current)),
        )

    def _read(self, file: Path) -> tuple[ClientSettings, ...]:
        both = (*self._listed, *read_clients(file).client)
        try:
            require_each_once(both)
        except PydanticCustomError as error:
            msg = f"{file}, combined with the clients in the settings: {error.message()}"
            raise ConfigurationError(msg) from error
        return both

    def _index(self) -> None:
        self._by_name = {one.name: caller_of(one) for one in self.all}
        self._by_key = {
            one.key_sha256: replace(caller_of(one), key_sha256=one.key_sha256)
            for one in self.all
            if one.key_sha256 is not None
        }


def read_clients(file: Path) -> ClientList:
    """Read a file of clients.

    Raises
    ------
    ConfigurationError
        With every mistake in it.
    """
    try:
        return validated(ClientList, read_toml(file))
    except DocumentError as error:
        raise ConfigurationError(str(error), str(file), error.reasons) from error


# A service with another user reads the new file as the old one, whatever the umask is.
def _keep_access(file: Path, partial: Path) -> None:
    found = file.stat()
    # Only root gives files away.
    with suppress(PermissionError):
        os.chown(partial, found.st_uid, found.st_gid)
    partial.chmod(stat.S_IMODE(found.st_mode))


def add_client(file: Path, client: ClientSettings) -> None:
    """Append a client to a file, which is created if there is none.

    Raises
    ------
    ConfigurationError
        If the file has mistakes, or has this client already.
    OSError
        If it cannot be written.
    """
    present = read_clients(file).client if file.exists() else ()
    if client.name in {one.name for one in present}:
        raise ConfigurationError(
            f"{file}: client {client.name} already exists; choose another name or remove it from "
            f"the file"
        )
    lines = ["[[client]]", f'name = "{client.name}"', f'role = "{client.role}"']
    if client.sensors:
        named = ", ".join(f'"{one}"' for one in client.sensors)
        lines.append(f"sensors = [{named}]")
    lines.append(f'key_sha256 = "{client.key_sha256}"')
    before = file.read_text(encoding="utf-8").rstrip("\n") + "\n\n" if present else ""
    partial = file.with_name(f".{file.name}.partial-{secrets.token_hex(4)}")
    try:
        partial.write_text(before + "\n".join(lines) + "\n", encoding="utf-8")
        if file.exists():
            _keep_access(file, partial)
        # A running service reads the old file or the new one.
        os.replace(partial, file)
    finally:
        partial.unlink(missing_ok=True)
