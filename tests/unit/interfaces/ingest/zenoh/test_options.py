"""Options of the Zenoh interface: defaults for this host only, messages for invalid values."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from multiradar.access.authentication import Authentication
from multiradar.app import zenoh_options
from multiradar.errors import ConfigurationError
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import with_port, zenoh_config
from multiradar.settings.service import load_settings


def setting(options: ZenohOptions, key: str) -> Any:
    return json.loads(zenoh_config(options).get_json(key))


def test_the_defaults_listen_on_loopback_without_discovery() -> None:
    options = zenoh_options(load_settings(None), Authentication())
    assert setting(options, "mode") == "peer"
    assert setting(options, "listen/endpoints") == ["tcp/127.0.0.1:7447"]
    assert setting(options, "connect/endpoints") == []
    assert setting(options, "scouting/multicast/enabled") is False
    assert setting(options, "scouting/gossip/enabled") is False
    assert setting(options, "transport/link/rx/max_message_size") == options.message_bytes_max


def test_the_lease_is_long_for_subscribers_and_short_for_routers() -> None:
    assert setting(ZenohOptions(), "transport/link/tx/lease") == 10_000
    behind = ZenohOptions(listen=(), connect=("tcp/127.0.0.1:7447",))
    assert setting(behind, "transport/link/tx/lease") == 2000
    assert setting(ZenohOptions(lease_s=3.5), "transport/link/tx/lease") == 3500


def test_a_client_waits_for_its_router_and_a_peer_does_not() -> None:
    client = ZenohOptions(
        mode="client", listen=(), connect=("tcp/127.0.0.1:7447",), client_wait_s=2.5
    )
    for options, timeout_ms in ((client, 2500), (ZenohOptions(), -1)):
        assert setting(options, "connect/timeout_ms") == timeout_ms
        assert setting(options, "connect/exit_on_failure") is (timeout_ms > 0)
        assert setting(options, "listen/exit_on_failure") is True
        assert setting(options, "timestamping/enabled") is True


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"mode": "broker"}, "expected one of peer, client, router, was 'broker'"),
        ({"mode": "client"}, "no endpoint to connect to"),
        ({"lease_s": 0.0}, "lease_s: expected a number above 0, was 0"),
        ({"message_bytes_max": -1}, "message_bytes_max: expected a number above 0, was -1"),
    ],
)
def test_an_invalid_option_is_rejected_with_a_message(wrong: Any, sentence: str) -> None:
    with pytest.raises(ConfigurationError, match=sentence):
        ZenohOptions(**wrong)


def test_an_invalid_endpoint_is_rejected() -> None:
    with pytest.raises(ConfigurationError, match="settings"):
        zenoh_config(ZenohOptions(listen=("nonsense",)))


@pytest.mark.parametrize("endpoint", ["nonsense", "[::1]:7447"])
def test_an_endpoint_of_a_file_is_reported_without_its_options(
    tmp_path: Path, endpoint: str
) -> None:
    """Regression: only the endpoints of the settings were shortened, and options may be keys."""
    file = tmp_path / "zenoh.json5"
    given = f"{endpoint}#connect_private_key_base64=c2Vj;a=secret"
    file.write_text(json.dumps({"connect": {"endpoints": [given]}}))
    with pytest.raises(ConfigurationError, match=r"zenoh\.json5: ") as error:
        zenoh_config(ZenohOptions(config_file=file))
    shown = str(error.value)
    assert endpoint in shown
    assert "<protocol>/<address>[?<metadata>][#<config>]" in shown
    assert not any(part in shown for part in ("c2Vj", "secret", "base64"))


@pytest.mark.parametrize("endpoint", ["tcp/127.0.0.1:0", "tls/[::1]:0#iface=lo"])
def test_a_free_port_is_found_for_port_0(endpoint: str) -> None:
    found = with_port(endpoint)
    assert re.sub(":[1-9][0-9]+", ":0", found) == endpoint != found
    assert with_port(found) == found
    assert with_port("tcp/no.such.host.invalid:0") == "tcp/no.such.host.invalid:0"
