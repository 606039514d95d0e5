"""Ray is started only where the user has named every interface."""

import pytest

from multiradar.cluster.interfaces import addresses_of_host, require_named
from multiradar.errors import ConfigurationError

LOOPBACK = {"lo": {"127.0.0.1", "::1"}}
TWO = {**LOOPBACK, "eth0": {"192.0.2.7", "fe80::1"}, "eth1": {"198.51.100.7", "10.0.0.7"}}


def test_the_loopback_interface_of_this_host_is_found() -> None:
    assert "127.0.0.1" in addresses_of_host()["lo"]


def test_nothing_is_named() -> None:
    with pytest.raises(ConfigurationError, match=r"cluster\.listen: missing; Ray may listen on"):
        require_named([], LOOPBACK)


def test_loopback_is_enough_where_there_is_nothing_else() -> None:
    require_named(["127.0.0.1"], LOOPBACK)


def test_loopback_is_not_enough_where_there_is_more() -> None:
    with pytest.raises(ConfigurationError, match=r"no address of interface eth0 \(192\.0\.2\.7"):
        require_named(["127.0.0.1"], TWO)


def test_each_interface_is_named() -> None:
    with pytest.raises(ConfigurationError, match=r"no address of interface eth1"):
        require_named(["192.0.2.7"], TWO)
    require_named(["192.0.2.7", "10.0.0.7"], TWO)


def test_an_address_of_another_host() -> None:
    with pytest.raises(
        ConfigurationError, match=r"expected an address of this host, was 203\.0\.113\.1; addresses"
    ):
        require_named(["203.0.113.1"], LOOPBACK)
