"""Types of settings: sections, and numbers with bounds."""

from ipaddress import IPv4Address, IPv4Network, ip_network
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

PORT_MAX = 65_535


def plain_number(value: Any) -> Any:
    """Reject values that Python accepts as numbers but users do not mean as such: `true`, "1_0"."""
    if isinstance(value, bool) or (isinstance(value, str) and "_" in value):
        raise PydanticCustomError("float_parsing", "Input should be a number")
    return value


def _ipv4(text: str) -> str:
    try:
        return str(IPv4Address(text))
    except ValueError as error:
        raise PydanticCustomError(
            "ipv4", "Input should be an IPv4 address such as 127.0.0.1"
        ) from error


def _ipv4_network(text: str) -> str:
    try:
        return str(IPv4Network(text))
    except ValueError as error:
        raise PydanticCustomError(
            "ipv4_network", "Input should be an IPv4 address or network such as 10.20.0.0/16"
        ) from error


def _ip_network(text: str) -> str:
    try:
        return str(ip_network(text))
    except ValueError as error:
        raise PydanticCustomError(
            "ip_network", "Input should be an IP address or network such as 10.20.0.0/16"
        ) from error


Count = Annotated[int, BeforeValidator(plain_number), Field(ge=1)]
Seconds = Annotated[float, BeforeValidator(plain_number), Field(gt=0.0)]
NotNegative = Annotated[float, BeforeValidator(plain_number), Field(ge=0.0)]
#: Buffer size of a socket, octets; a C integer.
SocketOctets = Annotated[int, BeforeValidator(plain_number), Field(ge=1, le=2**31 - 1)]
Port = Annotated[int, BeforeValidator(plain_number), Field(ge=0, le=PORT_MAX)]
Endpoint = Annotated[str, Field(pattern=r"^[a-z]+/[^\s/]+$")]
#: An IPv4 address in dotted decimal; names are not resolved.
Ipv4 = Annotated[str, AfterValidator(_ipv4)]
#: An IPv4 address or network.
Ipv4Network = Annotated[str, AfterValidator(_ipv4_network)]
#: An IPv4 or IPv6 address or network.
IpNetwork = Annotated[str, AfterValidator(_ip_network)]
#: Name for counters, logs and the quarantine.
Label = Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{1,32}$")]


class Section(BaseModel):
    """A section of the settings: no unknown keys, no NaN."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
