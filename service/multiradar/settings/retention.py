"""The section `retention`: what `multiradar shorten` removes from the journal and its archive."""

from pathlib import Path
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, model_validator

from multiradar.settings.types import NotNegative, Section, plain_number
from multiradar_schemas.documents.tables import wrong

Octets = Annotated[int, BeforeValidator(plain_number), Field(ge=0)]


class RetentionSettings(Section):
    """Rules by age and octets for the journal and its archive; 0, the default, is no rule."""

    archive: Annotated[
        Path | None, Field(description="Output of `multiradar archive` for this journal")
    ] = None
    journal_days: Annotated[
        NotNegative,
        Field(
            description="Maximum age of archived entries in the journal, days; older entries are "
            "removed"
        ),
    ] = 0.0
    journal_octets: Annotated[
        Octets,
        Field(
            description="Maximum journal size, octets; above it, the oldest archived entries are "
            "removed"
        ),
    ] = 0
    archive_days: Annotated[
        NotNegative, Field(description="Maximum age of segments, days; older segments are removed")
    ] = 0.0
    archive_octets: Annotated[
        Octets,
        Field(
            description="Maximum archive size, octets; above it, the oldest segments are removed"
        ),
    ] = 0
    recording_days: Annotated[
        NotNegative,
        Field(description="Legal recording: retention period of segments, days"),
    ] = 30.0

    @model_validator(mode="after")
    def _check_recording(self) -> Self:
        if 0.0 < self.archive_days < self.recording_days:
            raise wrong(
                f"archive_days: expected at least recording_days ({self.recording_days:g}), the "
                f"legal retention period for recordings, was {self.archive_days:g}"
            )
        return self
