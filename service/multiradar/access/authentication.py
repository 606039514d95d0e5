"""Who a caller is, from its key, its token or its certificate."""

from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

from starlette.types import Scope

from multiradar.access.attempts import Attempts
from multiradar.access.clients import ANYONE, DEFAULT_FILE, KEY_PREFIX, Caller, Clients
from multiradar.access.security_log import RepeatedEvents
from multiradar.access.shares import client_at
from multiradar.access.tokens import TOKEN_PREFIX, ClaimError, Tokens
from multiradar.clock import Clock, SystemClock
from multiradar.errors import ConfigurationError, RequestError
from multiradar.settings.access import AccessSettings

#: Key of the state of a connection: the verified certificate of the client.
CERTIFICATE = "certificate"

CREDENTIALS_INVALID = "CREDENTIALS_INVALID"
_CHALLENGE = {"www-authenticate": 'Bearer realm="multiradar"'}
_MISSING = "expected an API key or a token (Authorization: Bearer …), or a client certificate"
_INVALID = "the key or token is not valid: unknown, expired or revoked"
_CERTIFICATE_INVALID = "the certificate is not valid: expired, or its name is not that of a client"


class ClientCertificate(NamedTuple):
    """A verified certificate of a client: its common name, and its end, Unix time, s."""

    name: str
    until_s: float


class Authentication:
    """Finds the caller of a request.

    Parameters
    ----------
    settings : AccessSettings, optional
        Clients and issuer; by default there are none.
    clock : Clock, optional
        Time of the security log, and of the end of tokens.

    Attributes
    ----------
    settings : AccessSettings
        The clients and issuer.
    required : bool
        Whether callers need credentials. Without any in the settings, all callers may do all.
    events : RepeatedEvents
        Logs rejections.
    attempts : Attempts
        Counts wrong credentials.

    Raises
    ------
    ConfigurationError
        If a file cannot be used.
    """

    def __init__(self, settings: AccessSettings | None = None, clock: Clock | None = None) -> None:
        self.settings = settings = settings or AccessSettings()
        self._clock = clock or SystemClock()
        self.events = RepeatedEvents(self._clock)
        self.attempts = Attempts(self._clock)
        self.clients = Clients(settings.clients, settings.keys_file)
        self._tokens = None if settings.issuer is None else Tokens(settings.issuer)
        self.required = settings.has_credentials
        if settings.client_authority is not None and not self.required:
            raise ConfigurationError(
                "access.client_authority: no clients are configured; add the names in their "
                "certificates to keys.toml or access.clients"
            )

    def caller(self, bearer: str | None, certificate: ClientCertificate | None) -> Caller:
        """Return the caller with these credentials.

        Parameters
        ----------
        bearer : str or None
            API key or token.
        certificate : ClientCertificate or None
            A certificate that was verified when the connection was opened.

        Raises
        ------
        RequestError
            401 without credentials, or with such that are not valid.
        """
        if not self.required:
            return ANYONE
        if bearer is not None:
            found = self._bearer(bearer)
            reason = _INVALID
        elif certificate is not None:
            found = self._certified(certificate)
            reason = _CERTIFICATE_INVALID
        else:
            raise RequestError(401, "CREDENTIALS_MISSING", _MISSING, _CHALLENGE)
        if found is None:
            raise RequestError(401, CREDENTIALS_INVALID, reason, _CHALLENGE)
        return found

    def client(self, scope: Scope) -> str:
        """Return the client of a request, for its shares: its name, or else its address."""
        address = scope.get("client") or ("unknown", 0)
        if self.required:
            bearer, certificate = bearer_of(scope), scope.get("state", {}).get(CERTIFICATE)
            if bearer is not None or certificate is not None:
                with suppress(RequestError):
                    return f"client {self.caller(bearer, certificate).name}"
        return client_at(address[0])

    def is_current(self, caller: Caller) -> bool:
        """Return whether the credentials of a caller have neither expired nor been revoked."""
        if self._clock.now_s() >= caller.until_s:
            return False
        if caller is ANYONE or caller.name.startswith(TOKEN_PREFIX):
            return True
        if caller.key_sha256 is not None:
            return self.clients.by_digest(caller.key_sha256) == caller
        return self._certified(ClientCertificate(caller.name, caller.until_s)) == caller

    def _certified(self, certificate: ClientCertificate) -> Caller | None:
        found = self.clients.by_name(certificate.name)
        if found is None or self._clock.now_s() >= certificate.until_s:
            return None
        return replace(found, until_s=certificate.until_s)

    def _bearer(self, bearer: str) -> Caller | None:
        if bearer.startswith(KEY_PREFIX):
            return self.clients.by_key(bearer)
        try:
            return None if self._tokens is None else self._tokens.caller(bearer)
        except ClaimError as error:
            msg = f"the token is not valid: {error}"
            raise RequestError(401, CREDENTIALS_INVALID, msg, _CHALLENGE) from error


def bearer_of(scope: Scope) -> str | None:
    """Return the key or token in the headers of a request."""
    for name, value in scope["headers"]:
        if name == b"authorization":
            scheme, _, bearer = value.decode("latin-1").partition(" ")
            return bearer if scheme.lower() == "bearer" and bearer else None
    return None


def with_default_file(settings: AccessSettings) -> AccessSettings:
    """Return settings that name `keys.toml` if there is one and they name no other file."""
    if settings.keys_file is not None or not DEFAULT_FILE.exists():
        return settings
    return settings.model_copy(update={"keys_file": DEFAULT_FILE})
