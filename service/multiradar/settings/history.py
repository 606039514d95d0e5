"""The section `history`: tables of tracks, biases, health and measurements, kept on disk."""

from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field

from multiradar.settings.types import NotNegative, Section, plain_number


class HistorySettings(Section):
    """Where the service writes its history, and how much of it is kept; 0, the default: all."""

    folder: Annotated[
        Path | None,
        Field(description="History folder, not shared with other services; absent: no history"),
    ] = None
    days: Annotated[
        NotNegative, Field(description="Maximum age of the history, days; older hours are removed")
    ] = 0.0
    octets: Annotated[
        int,
        BeforeValidator(plain_number),
        Field(
            ge=0,
            description="Maximum size of the history, octets; above it, the oldest hours are "
            "removed",
        ),
    ] = 0
