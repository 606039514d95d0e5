"""Which configured endpoints have no link."""

import pytest

from multiradar.ingest.zenoh.links import missing_links

A, B = "tcp/router-a:7447", "tcp/router-b:7447"


@pytest.mark.parametrize(
    ("connect", "linked", "missing"),
    [
        ((), ("tcp/10.0.0.1:40000",), ()),
        ((A,), ("tcp/10.0.0.1:7447",), ()),
        ((A,), ("tcp/10.0.0.1:7448", "udp/10.0.0.1:7447"), (A,)),
        # Names of equal ports are counted: which of them has a link is not known.
        ((A, B), (), (A, B)),
        ((A, B), ("tcp/10.0.0.1:7447",), (f"one of {A}, {B}",)),
        ((A, B), ("tcp/10.0.0.1:7447", "tcp/10.0.0.1:7447"), (f"one of {A}, {B}",)),
        ((A, B), ("tcp/10.0.0.1:7447", "tcp/10.0.0.2:7447"), ()),
        ((A, A), ("tcp/10.0.0.1:7447",), ()),
        # Addresses are compared, and their links are not those of names.
        (("tcp/10.0.0.1:7", "tcp/10.0.0.2:7"), ("tcp/10.0.0.2:7",), ("tcp/10.0.0.1:7",)),
        (("tcp/10.0.0.1:7447", A), ("tcp/10.0.0.1:7447",), (A,)),
        (("tls/[2001:DB8::0:1]:7447",), ("tls/[2001:db8::1]:7447",), ()),
        (("tcp/[fe80::1%eth0]:7447",), ("tcp/[fe80::1%2]:7447",), ()),
        (("tcp/0.0.0.0:7447",), ("tcp/127.0.0.1:7447",), ()),
        (("tcp/10.0.0.1:7447#iface=eth0",), ("tcp/10.0.0.1:7447?rel=1",), ()),
        (("unixsock-stream//run/a", "unixsock-stream//run/b"), ("unixsock-stream//run/a",),
         ("unixsock-stream//run/b",)),
    ],
)  # fmt: skip
def test_each_endpoint_needs_a_link(
    connect: tuple[str, ...], linked: tuple[str, ...], missing: tuple[str, ...]
) -> None:
    assert missing_links(connect, linked, one=False) == missing


def test_a_client_needs_one_link() -> None:
    connect = ("tcp/10.0.0.1:7447", "tcp/10.0.0.2:7448")
    assert missing_links(connect, (), one=True) == connect
    assert missing_links(connect, ("tcp/10.0.0.2:7448",), one=True) == ()
    assert missing_links((A, B), ("tcp/10.0.0.2:7447",), one=True) == ()
