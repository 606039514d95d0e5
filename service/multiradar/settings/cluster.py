"""The section of the cluster."""

from typing import Annotated

from pydantic import Field

from multiradar.settings.types import Ipv4, Seconds, Section


class ClusterSettings(Section):
    """The engine `ray`: addresses on which Ray may listen, and the cluster."""

    listen: Annotated[
        tuple[Ipv4, ...],
        Field(
            description="Addresses of this host on which Ray may listen, at least one per "
            "interface; the first is the node address. Required for engine ray"
        ),
    ] = ()
    head: Annotated[
        str | None,
        Field(
            pattern=r"^[^\s/]+:\d{1,5}$",
            description="Address of a Ray cluster to join; default: start a cluster on this host",
        ),
    ] = None
    deadline_s: Annotated[
        Seconds, Field(description="Time without a response after which a shard is replaced, s")
    ] = 10.0
