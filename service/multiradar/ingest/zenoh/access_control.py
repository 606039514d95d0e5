"""Access control of the session: what others may send to it, by the names in their certificates.

Everything that no rule allows is denied. What the service publishes is denied to all others, with
credentials and without: a client that put tracks would reach other clients through the session.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from multiradar.ingest.zenoh.keys import (
    BIASES,
    CLOCK,
    FLUSH,
    HANDOVERS,
    MEASUREMENTS,
    ROOT,
    SENSORS,
    STATUS,
    TRACKS,
    query_key,
)
from multiradar.runtime.queries.registry import QUERIES
from multiradar.settings.access import AccessSettings, ClientSettings, Role

_CACHES = f"{ROOT}/*/*/@adv/**"
#: All keys: of a subscriber to anything, and of the caches, which wildcards do not match.
_ALL = ("**", _CACHES)
#: Keys of queries that change nothing. A query with wildcards beyond them would reach the others.
_OUTPUT = (
    f"{TRACKS}/**", f"{BIASES}/**", f"{SENSORS}/**", STATUS, _CACHES,
    *(query_key(one, "*") for one in QUERIES),
)  # fmt: skip
#: What a reader sends, and what it receives.
_SUBSCRIBED = ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
_SENT = (
    "put", "delete", "reply", "declare_queryable", "declare_subscriber", "query",
    "liveliness_token", "declare_liveliness_subscriber", "liveliness_query",
)  # fmt: skip


def access_control(access: AccessSettings, *, is_local: bool = True) -> dict[str, Any]:
    """Return the section `access_control` of the configuration of the session.

    Parameters
    ----------
    access : AccessSettings
        The clients. Without credentials in the settings all may read and send measurements.
    is_local : bool
        Whether only sessions of this machine connect: without credentials they may operate, too.
    """
    if access.has_credentials:
        subjects = [{"id": one.name, "cert_common_names": [one.name]} for one in access.clients]
        granted = [(one.name, _rules_of(one)) for one in access.clients]
    else:
        # A subject without attributes is everybody.
        subjects = [{"id": "all"}]
        granted = [("all", _EVERYTHING if is_local else _MEASURING)]
    rules = [
        _rule("subscribe", "ingress", _SUBSCRIBED, _ALL),
        _rule("read", "ingress", ("query",), _OUTPUT),
        _rule("written", "egress", _SENT, _ALL),
        _rule("measure", "ingress", ("put", "query"), (f"{MEASUREMENTS}/*",)),
        _rule("operate", "ingress", ("query",), (FLUSH, CLOCK)),
        _rule("receipts", "egress", ("reply", "declare_queryable"), (f"{MEASUREMENTS}/*",)),
        *_rules_of_sensors(access.clients),
    ]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": [{"rules": list(names), "subjects": [who]} for who, names in granted],
    }


def handover_control(region: str, neighbours: Sequence[str], *, certified: bool) -> dict[str, Any]:
    """Return the access control of the session between neighbouring regions.

    A neighbour may put what it hands over, under its own name, and receive what this region hands
    over; nothing else.

    Parameters
    ----------
    region : str
        Name of this region.
    neighbours : sequence of str
        Names of its neighbours: the common names of their certificates.
    certified : bool
        Whether there are certificates. Without, all that connect are neighbours.
    """
    own = (f"{HANDOVERS}/{region}",)
    keys = {n: f"{HANDOVERS}/{n}" for n in neighbours}
    rules = [
        _rule("subscribe", "ingress", ("declare_subscriber",), own),
        _rule("hand-over", "egress", ("put",), own),
        _rule("receive", "egress", ("declare_subscriber",), keys.values()),
        *(_rule(f"put-{n}", "ingress", ("put",), (key,)) for n, key in keys.items()),
    ]
    common = ["subscribe", "hand-over", "receive"]
    subjects: list[dict[str, Any]] = [{"id": "all"}]
    policies = [{"rules": [*common, *(f"put-{n}" for n in neighbours)], "subjects": ["all"]}]
    if certified:
        subjects = [{"id": n, "cert_common_names": [n]} for n in neighbours]
        policies = [{"rules": [*common, f"put-{n}"], "subjects": [n]} for n in neighbours]
    return {
        "enabled": True, "default_permission": "deny",
        "rules": rules, "subjects": subjects, "policies": policies,
    }  # fmt: skip


_READER = ("subscribe", "read", "written")
_MEASURING = (*_READER, "measure")
_EVERYTHING = (*_MEASURING, "operate")


def _rules_of(client: ClientSettings) -> tuple[str, ...]:
    if client.role is Role.OPERATE:
        return _EVERYTHING
    if client.role is Role.DISPLAY:
        return _READER
    return (f"measure-{client.name}" if client.sensors else "measure", "receipts")


def _rules_of_sensors(clients: Sequence[ClientSettings]) -> Iterator[dict[str, Any]]:
    for one in clients:
        if one.sensors:
            keys = [f"{MEASUREMENTS}/{sensor}" for sensor in one.sensors]
            yield _rule(f"measure-{one.name}", "ingress", ("put", "query"), keys)


def _rule(name: str, flow: str, messages: Sequence[str], keys: Iterable[str]) -> dict[str, Any]:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": list(keys),
    }
