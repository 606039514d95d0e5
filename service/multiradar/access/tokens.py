"""JSON Web Tokens of a configured issuer."""

import json
from pathlib import Path
from typing import Any, TypeVar

import jwt
from pydantic import TypeAdapter, ValidationError

from multiradar.access.clients import Caller
from multiradar.access.watched import Watched
from multiradar.errors import ConfigurationError
from multiradar.settings.access import ClientName, IssuerSettings, Role
from multiradar_schemas.measurements.measurement import SensorName

#: Difference of clocks that is tolerated, s.
_LEEWAY_S = 30.0
#: Begins the names of callers with tokens; no other client has such a name.
TOKEN_PREFIX = "jwt:"
_REQUIRED = ("exp", "iss", "aud", "sub")
_NAME = TypeAdapter[str](ClientName)
_NAME_FORM = "1 to 64 letters, digits, dots, underscores or hyphens"
_SENSORS = TypeAdapter[frozenset[str]](frozenset[SensorName])
_SENSORS_FORM = "a list of sensor names"

_T = TypeVar("_T")


class ClaimError(ValueError):
    """A claim of a token of the issuer has another form."""


class Tokens:
    """Verifies tokens of one issuer.

    Raises
    ------
    ConfigurationError
        If its keys cannot be read.
    """

    def __init__(self, issuer: IssuerSettings) -> None:
        self._issuer = issuer
        self._keys = Watched(issuer.keys, _read_keys, "issuer_keys")
        self._keys.current()

    def caller(self, token: str) -> Caller | None:
        """Return the caller that a token names; None if it is not valid.

        The name is `jwt:` and the subject.

        Raises
        ------
        ClaimError
            If the signature is valid, but the subject or the sensors have another form.
        """
        issuer = self._issuer
        try:
            key = self._keys.current()[jwt.get_unverified_header(token).get("kid")]
            claims = jwt.decode(
                token,
                key,
                algorithms=list(issuer.algorithms),
                audience=issuer.audience,
                issuer=issuer.name,
                leeway=_LEEWAY_S,
                options={"require": list(_REQUIRED)},
            )
            until_s = float(claims["exp"]) + _LEEWAY_S
        except (
            jwt.InvalidTokenError,
            KeyError,
            TypeError,
            ValueError,
            OverflowError,
            RecursionError,
        ):
            return None
        return _caller(claims, until_s)


def _caller(claims: dict[str, Any], until_s: float) -> Caller:
    scopes = str(claims.get("scope", "")).split()
    return Caller(
        TOKEN_PREFIX + _claim(claims, "sub", _NAME, _NAME_FORM),
        frozenset(role for role in Role if role in scopes),
        # A list without sensors permits none.
        _claim(claims, "sensors", _SENSORS, _SENSORS_FORM) if "sensors" in claims else None,
        until_s,
    )


def _claim(claims: dict[str, Any], name: str, form: TypeAdapter[_T], expected: str) -> _T:
    try:
        return form.validate_python(claims[name])
    except ValidationError as error:
        msg = f"{name}: expected {expected}"
        raise ClaimError(msg) from error


def _read_keys(file: Path) -> dict[str | None, Any]:
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
        found = jwt.PyJWKSet.from_dict(document)
    except (OSError, ValueError, AttributeError, RecursionError, jwt.PyJWTError) as error:
        raise ConfigurationError(f"{file}: expected a JSON Web Key Set: {error}") from error
    private = [one for one in document["keys"] if "d" in one or one.get("kty") == "oct"]
    if private:
        raise ConfigurationError(
            f"{file}: contains a private or secret key; remove all private and secret keys"
        )
    return {one.key_id: one for one in found.keys}
