"""What listens beyond loopback needs credentials."""

from pathlib import Path
from typing import Any, cast

import pytest
from structlog.testing import capture_logs

from multiradar.access.exposure import is_local, is_loopback, require_credentials
from multiradar.errors import ConfigurationError
from multiradar.ingest.zenoh.handovers import region_exchange
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import require_guarded
from multiradar.settings.access import AccessSettings
from multiradar.settings.service import Settings, load_settings
from support.access import clients


def settings_of(**sections: Any) -> Settings:
    return load_settings(None, sections)


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("127.0.0.1", True),
        ("127.1.2.3", True),
        ("::1", True),
        ("[::1]", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("::", False),
        ("192.0.2.1", False),
        ("localhost.example.org", False),
        ("", False),
    ],
)
def test_loopback_is_known(host: str, expected: bool) -> None:
    assert is_loopback(host) == expected


def test_the_defaults_need_no_credentials() -> None:
    require_credentials(settings_of(), authenticated=False)


OPEN = [
    ({"server": {"host": "0.0.0.0"}}, "server.host: 0.0.0.0 is reachable from other hosts"),
    ({"server": {"host": "::"}}, "server.host"),
    (
        {"asterix": {"listen": [{"address": "0.0.0.0", "port": 8600}]}},
        "asterix.listen 0.0.0.0-8600: 0.0.0.0 is not a loopback address",
    ),
    (
        {
            "asterix": {
                "listen": [
                    {
                        "address": "239.1.1.1",
                        "interface": "192.0.2.1",
                        "port": 8600,
                        "name": "north",
                    }
                ]
            }
        },
        "asterix.listen north: 192.0.2.1 is not a loopback address",
    ),
    (
        {"feeds": {"source": [{"url": "listen://0.0.0.0:30104"}]}},
        "feeds.source 0.0.0.0:30104: 0.0.0.0 is not a loopback address",
    ),
    (
        {"asterix": {"connect": [{"url": "listen://[::]:30104", "name": "roof"}]}},
        "asterix.connect roof: :: is not a loopback address",
    ),
]


@pytest.mark.parametrize(("sections", "reason"), OPEN)
def test_other_addresses_are_rejected_with_the_remedy(
    sections: dict[str, Any], reason: str
) -> None:
    with pytest.raises(ConfigurationError, match=f"{reason}.*--insecure"):
        require_credentials(settings_of(**sections), authenticated=False)


@pytest.mark.parametrize(("sections", "reason"), OPEN)
def test_insecure_is_allowed_on_request_and_logged(sections: dict[str, Any], reason: str) -> None:
    with capture_logs() as logs:
        require_credentials(settings_of(**sections, access={"insecure": True}), authenticated=False)
    assert [one["event"] for one in logs] == ["insecure"]


def test_keys_protect_http_and_plain_http_is_logged() -> None:
    with capture_logs() as logs:
        require_credentials(settings_of(server={"host": "0.0.0.0"}), authenticated=True)
    assert [one["event"] for one in logs] == ["not_encrypted"]


def test_data_of_listed_senders_or_on_loopback_are_received() -> None:
    listen = [
        {"address": "0.0.0.0", "port": 8600, "senders": ["10.20.0.0/16"]},
        {"address": "239.1.1.1", "interface": "127.0.0.1", "port": 8600},
        {"address": "127.0.0.1", "port": 8600},
    ]
    connect = [
        {"url": "tcp://192.0.2.1:30006"},
        {"url": "listen://127.0.0.1:30006"},
        {"url": "listen://[::]:30007", "senders": ["2001:db8::/32"]},
    ]
    source = [
        {"url": "http://192.0.2.1/data/aircraft.json"},
        {"url": "listen://localhost:30104"},
        {"url": "listen://0.0.0.0:30104", "senders": ["10.20.0.0/16"]},
    ]
    settings = settings_of(asterix={"listen": listen, "connect": connect}, feeds={"source": source})
    require_credentials(settings, authenticated=False)


def test_senders_are_listed_for_listeners_only() -> None:
    wrong = {"url": "tcp://192.0.2.1:30006", "senders": ["10.20.0.0/16"]}
    for sections in ({"asterix": {"connect": [wrong]}}, {"feeds": {"source": [wrong]}}):
        with pytest.raises(ConfigurationError, match="senders apply to listen:// only"):
            settings_of(**sections)
    with pytest.raises(ConfigurationError, match="IP address or network"):
        settings_of(feeds={"source": [{"url": "listen://0.0.0.0:1", "senders": ["roof"]}]})


@pytest.mark.parametrize(
    ("endpoint", "expected"),
    [
        ("tcp/127.0.0.1:7447", True),
        ("tcp/[::1]:7447", True),
        ("unixsock-stream//run/zenoh.sock", True),
        ("tcp/0.0.0.0:7447", False),
        ("tcp/[::]:7447#iface=lo", False),
        ("udp/192.0.2.1:7447", False),
        ("tls/127.0.0.1.example.org:7447", False),
    ],
)
def test_local_endpoints_of_zenoh_are_known(endpoint: str, expected: bool) -> None:
    assert is_local(endpoint) == expected


def zenoh_of(*listen: str, **access: Any) -> ZenohOptions:
    return ZenohOptions(listen=listen, access=AccessSettings(**access))


def test_zenoh_beyond_loopback_needs_certificates_of_clients(tmp_path: Path) -> None:
    require_guarded(zenoh_of("tcp/127.0.0.1:7447"))
    files = {name: tmp_path / name for name in ("certificate", "private_key")}
    authority = {"client_authority": tmp_path / "ca", "clients": clients()}
    for options in (
        zenoh_of("tcp/0.0.0.0:7447"),
        zenoh_of("tcp/0.0.0.0:7447", **files, **authority),
        zenoh_of("tls/0.0.0.0:7447", **files),
    ):
        with pytest.raises(ConfigurationError, match=r"zenoh\.listen: expected .*--insecure"):
            require_guarded(options)
    require_guarded(zenoh_of("tls/0.0.0.0:7447", **files, **authority))
    with capture_logs() as logs:
        require_guarded(zenoh_of("tcp/0.0.0.0:7447", insecure=True))
    assert [one["event"] for one in logs] == ["insecure"]


def test_a_zenoh_file_without_endpoints_listens_everywhere(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text('{ mode: "router" }')
    with pytest.raises(ConfigurationError, match=r"zenoh\.listen"):
        require_guarded(ZenohOptions(config_file=file))


def test_neighbours_from_elsewhere_need_certificates_before_anything_starts() -> None:
    region = {
        "name": "west", "latitude_deg": 49.0, "longitude_deg": 8.0, "listen": ["tcp/0.0.0.0:7450"],
        "neighbours": [{"name": "east", "latitude_deg": 49.0, "longitude_deg": 14.0}],
    }  # fmt: skip
    with pytest.raises(ConfigurationError, match=r"region\.listen: expected a loopback address"):
        region_exchange(cast(Any, None), settings_of(region=region), AccessSettings())
