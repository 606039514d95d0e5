"""The section `access`: who may do what.

::

    [access]
    keys_file = "keys.toml"
    certificate = "service.pem"
    private_key = "service.key"
    client_authority = "ca.pem"

    [access.issuer]
    name = "https://login.example.org"
    keys = "jwks.json"

    [[access.clients]]
    name = "radar-26-10"
    role = "feed"
    sensors = ["26-10"]
    key_sha256 = "…"
"""

from collections import Counter
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from multiradar.settings.types import Section
from multiradar_schemas.documents.tables import wrong
from multiradar_schemas.measurements.measurement import SensorName

#: Clients in a list.
CLIENTS_MAX = 1000

#: Name of a client: in the log, and the common name of its certificate.
ClientName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9._-]{1,64}$")]
Algorithm = Literal["RS256", "RS384", "RS512", "PS256", "ES256", "ES384", "EdDSA"]


class Role(StrEnum):
    """What a client may do; nothing else."""

    FEED = "feed"
    """Send measurements, of some sensors or of all."""
    DISPLAY = "display"
    """Read tracks, biases, status and all other output."""
    OPERATE = "operate"
    """Everything, including operations that affect all clients, such as ending a stream."""


class ClientSettings(Section):
    """A client.

    Attributes
    ----------
    name : str
        Its name in logs and in the journal, and the common name of its certificate if it has one.
    role : Role
        What it may do.
    sensors : tuple of str
        With the role `feed`: the only sensors whose measurements it may send; default: all.
    key_sha256 : str, optional
        SHA-256 of its API key, hexadecimal; without it only a certificate proves the name.
    """

    name: ClientName
    role: Role
    sensors: tuple[SensorName, ...] = ()
    key_sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")] | None = None

    @model_validator(mode="after")
    def _sensors_are_of_a_feed(self) -> Self:
        if not self.sensors and "sensors" in self.model_fields_set:
            raise wrong("sensors: expected at least one; remove the key to permit all sensors")
        if self.sensors and self.role is not Role.FEED:
            raise wrong("sensors apply to the role feed only; remove them or change the role")
        return self


class ClientList(Section):
    """Clients: the content of `keys.toml`."""

    client: Annotated[tuple[ClientSettings, ...], Field(max_length=CLIENTS_MAX)] = ()

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        require_each_once(self.client)
        return self


class IssuerSettings(Section):
    """An issuer of JSON Web Tokens (RFC 7519).

    Attributes
    ----------
    name : str
        Claim `iss`.
    audience : str
        Claim `aud`.
    keys : Path
        Its public keys, a JSON Web Key Set (RFC 7517); a file, the service requests nothing.
    algorithms : tuple of str
        Algorithms of signatures that are accepted.
    """

    name: Annotated[str, Field(min_length=1)]
    audience: Annotated[str, Field(min_length=1)] = "multiradar"
    keys: Path
    algorithms: Annotated[tuple[Algorithm, ...], Field(min_length=1)] = ("ES256", "RS256", "EdDSA")


class AccessSettings(Section):
    """Clients and how they prove who they are.

    Attributes
    ----------
    keys_file : Path, optional
        File of clients (`[[client]]`); default: `keys.toml` if there is one. It is read again when
        it changes.
    clients : tuple of ClientSettings
        Further clients.
    issuer : IssuerSettings, optional
        Accepts JSON Web Tokens with the claims `sub`, `scope` (a role) and perhaps `sensors`.
    certificate, private_key : Path, optional
        Certificate of the service and its key (PEM): HTTP with TLS, and Zenoh endpoints `tls/…`.
    client_authority : Path, optional
        Authority of certificates of clients (PEM), whose common names are those of clients.
    insecure : bool
        Whether to listen beyond loopback without credentials.
    """

    keys_file: Path | None = None
    clients: Annotated[tuple[ClientSettings, ...], Field(max_length=CLIENTS_MAX)] = ()
    issuer: IssuerSettings | None = None
    certificate: Path | None = None
    private_key: Path | None = None
    client_authority: Path | None = None
    insecure: bool = False

    @property
    def has_credentials(self) -> bool:
        """Whether clients need credentials."""
        return bool(self.keys_file or self.clients or self.issuer)

    @model_validator(mode="after")
    def _files_belong_together(self) -> Self:
        require_each_once(self.clients)
        if (self.certificate is None) != (self.private_key is None):
            raise wrong("expected both certificate and private_key or neither, found only one")
        if self.client_authority is not None and self.certificate is None:
            raise wrong(
                "client_authority requires the service's own certificate; set certificate and "
                "private_key"
            )
        return self


def require_each_once(clients: tuple[ClientSettings, ...]) -> None:
    """Check that each name and each key is that of one client.

    Raises
    ------
    PydanticCustomError
        If one is repeated.
    """
    keys = [one.key_sha256 for one in clients if one.key_sha256 is not None]
    for what, values in (("name", [one.name for one in clients]), ("key_sha256", keys)):
        for value, count in Counter(values).items():
            if count > 1:
                raise wrong(f"expected each {what} once, found {value} {count} times")
