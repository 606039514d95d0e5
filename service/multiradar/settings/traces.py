"""The section `traces`: spans of messages for an OpenTelemetry collector on this host."""

from typing import Annotated

from pydantic import BeforeValidator, Field

from multiradar.settings.types import Section, plain_number


class TracesSettings(Section):
    """Where spans are sent: the path of each message from reception to publication."""

    endpoint: Annotated[
        str | None,
        Field(
            pattern=r"^http://(127\.0\.0\.1|localhost|\[::1\]):[0-9]{1,5}$",
            description="Collector on this host, OTLP over HTTP, such as http://127.0.0.1:4318; "
            "absent: no traces. Needs the extra `traces`",
        ),
    ] = None
    fraction: Annotated[
        float,
        BeforeValidator(plain_number),
        Field(gt=0.0, le=1.0, description="Fraction of messages to trace"),
    ] = 1.0
