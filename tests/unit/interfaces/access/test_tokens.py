"""JSON Web Tokens: those of the issuer, and forged ones."""

import base64
import hmac
import json
from pathlib import Path
from typing import Any

import jwt
import pytest
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from multiradar.access.authentication import Authentication
from multiradar.clock import FixedClock, SystemClock
from multiradar.errors import ConfigurationError, RequestError
from multiradar.settings.access import IssuerSettings, Role
from support.access import authentication

ISSUER = "https://login.example.org"
_OURS = ec.generate_private_key(ec.SECP256R1())
_STRANGER = ec.generate_private_key(ec.SECP256R1())
_RSA = rsa.generate_private_key(public_exponent=65537, key_size=2048)


def public(key: Any, kid: str, algorithm: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(algorithm.to_jwk(key.public_key()))
    return found | {"kid": kid, "use": "sig"}


@pytest.fixture
def found(tmp_path: Path) -> Authentication:
    keys = tmp_path / "jwks.json"
    listed = [
        public(_OURS, "ours", jwt.algorithms.ECAlgorithm),
        public(_RSA, "rsa", jwt.algorithms.RSAAlgorithm),
    ]
    keys.write_text(json.dumps({"keys": listed}))
    return authentication(issuer=IssuerSettings(name=ISSUER, keys=keys))


def claims(**changes: Any) -> dict[str, Any]:
    now_s = SystemClock().now_s()
    valid = {
        "iss": ISSUER, "aud": "multiradar", "sub": "alice", "exp": now_s + 600.0,
        "scope": "openid display",
    }  # fmt: skip
    return {name: value for name, value in {**valid, **changes}.items() if value is not None}


def token(key: Any = _OURS, algorithm: str = "ES256", kid: str = "ours", **changes: Any) -> str:
    return jwt.encode(claims(**changes), key, algorithm, {"kid": kid})


def test_a_token_gives_name_roles_and_sensors(found: Authentication) -> None:
    caller = found.caller(token(), None)
    assert (caller.name, set(caller.roles), caller.sensors) == (
        "jwt:alice",
        {Role.DISPLAY},
        None,
    )
    bound = found.caller(token(_RSA, "RS256", "rsa", scope="feed", sensors=["26-10"]), None)
    assert (bound.roles, bound.sensors) == (frozenset({Role.FEED}), frozenset({"26-10"}))
    assert not found.caller(token(scope=None), None).roles
    # A list without sensors permits none; no list permits all.
    assert found.caller(token(scope="feed", sensors=[]), None).sensors == frozenset()
    assert found.caller(token(scope="feed"), None).sensors is None


def encoded(content: bytes) -> str:
    return base64.urlsafe_b64encode(content).rstrip(b"=").decode()


def unsigned() -> str:
    parts = ({"alg": "none", "kid": "ours"}, claims())
    return ".".join([*(encoded(json.dumps(part).encode()) for part in parts), ""])


def with_other_claims() -> str:
    head, _, signature = token().split(".")
    return f"{head}.{encoded(json.dumps(claims(scope='operate')).encode())}.{signature}"


def signed_with_the_public_key() -> str:
    # The attack on verifiers that take a public key for a shared secret.
    secret = _RSA.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)
    parts = ({"alg": "HS256", "kid": "rsa"}, claims())
    text = ".".join(encoded(json.dumps(part).encode()) for part in parts)
    return f"{text}.{encoded(hmac.digest(secret, text.encode(), 'sha256'))}"


@pytest.mark.parametrize(
    "forged",
    [
        lambda: token(_STRANGER),
        lambda: token(kid="unknown"),
        lambda: token(iss="https://elsewhere.example.org"),
        lambda: token(aud="another-service"),
        lambda: token(exp=SystemClock().now_s() - 3600.0),
        lambda: token(exp=None),
        lambda: token(exp=10**400),
        lambda: token(exp=float("inf")),
        lambda: token(sub=None),
        lambda: token(sub="a b"),
        lambda: token(nbf=SystemClock().now_s() + 3600.0),
        lambda: token(sensors="26-10"),
        lambda: token(sensors=["../etc"]),
        unsigned,
        with_other_claims,
        signed_with_the_public_key,
        lambda: token()[:-4],
        lambda: "a.b.c",
        lambda: "",
    ],
)
@pytest.mark.fault(38)
def test_other_tokens_are_rejected(found: Authentication, forged: Any) -> None:
    with pytest.raises(RequestError, match="not valid"):
        found.caller(forged(), None)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"sub": "auth0|1"}, "sub: expected 1 to 64"),
        ({"sub": "x@clients"}, "sub: expected 1 to 64"),
        ({"sensors": "26-10"}, "sensors: expected a list of sensor names"),
    ],
)
def test_a_claim_of_another_form_is_named(
    found: Authentication, changes: dict[str, Any], reason: str
) -> None:
    with pytest.raises(RequestError, match="the token is not valid: " + reason):
        found.caller(token(**changes), None)
    # Only the issuer learns it.
    with pytest.raises(RequestError, match="unknown, expired or revoked"):
        found.caller(token(_STRANGER, **changes), None)


def test_a_token_ends(tmp_path: Path, found: Authentication) -> None:
    caller = found.caller(token(), None)
    later = FixedClock(caller.until_s - 1.0)
    again = authentication(
        issuer=IssuerSettings(name=ISSUER, keys=tmp_path / "jwks.json"), clock=later
    )
    assert again.is_current(caller)
    later.advance(1.0)
    assert not again.is_current(caller)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (None, "expected a JSON Web Key Set"),
        ("[]", "expected a JSON Web Key Set"),
        ("[" * 5000, "expected a JSON Web Key Set"),
        ('{"keys": []}', "expected a JSON Web Key Set"),
        (
            '{"keys": [{"kty": "oct", "k": "c2VjcmV0", "kid": "a"}]}',
            "remove all private and secret keys",
        ),
    ],
)
def test_unusable_keys_of_an_issuer_are_named(
    tmp_path: Path, content: str | None, reason: str
) -> None:
    keys = tmp_path / "jwks.json"
    if content is not None:
        keys.write_text(content)
    with pytest.raises(ConfigurationError, match=reason):
        authentication(issuer=IssuerSettings(name=ISSUER, keys=keys))
