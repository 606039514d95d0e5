"""The section `history`: tables of tracks, biases, health and measurements, kept on disk."""

from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field

from multiradar.settings.types import NotNegative, Section, plain_number


class HistorySettings(Section):
    """Where the service writes its history, and how much of it is kept; 0, the default: all."""

    folder: Annotated[
        Path | None,
        Field(description="Folder of the history, for each service its own; absent: none"),
    ] = None
    days: Annotated[
        NotNegative, Field(description="Age of the data above which hours are removed, days")
    ] = 0.0
    octets: Annotated[
        int,
        BeforeValidator(plain_number),
        Field(ge=0, description="Size of the history above which its oldest hours are removed"),
    ] = 0
