"""Models of composite answers, for the OpenAPI document."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from multiradar.api.answers.encoding import ARROW, GEOJSON
from multiradar_schemas.products.bias import BiasEstimate
from multiradar_schemas.products.health import RadarHealth
from multiradar_schemas.products.track import Track, TrackUpdate
from multiradar_schemas.products.transition import Transition

_CURSOR = Field(description="`cursor` for the next page; null on the last page")
_COUNT = Field(description="Number of rows in this response")


def _chosen_fields(schema: dict[str, Any]) -> None:
    schema["required"] = ["track_id"]


class ListedTrack(Track):
    """A live track; with the parameter `fields`, only these fields."""

    model_config = ConfigDict(json_schema_extra=_chosen_fields)


class TrackPage(BaseModel):
    """A page of live tracks."""

    count: int = _COUNT
    next_cursor: str | None = _CURSOR
    tracks: list[ListedTrack]


class HistoryPage(BaseModel):
    """A page of the updates of one track, oldest first."""

    count: int = _COUNT
    next_cursor: str | None = _CURSOR
    updates: list[TrackUpdate]


class TransitionPage(BaseModel):
    """A page of the state transitions of one track, oldest first."""

    count: int = _COUNT
    next_cursor: str | None = _CURSOR
    transitions: list[Transition]


class BiasAnswer(BaseModel):
    """Bias estimates of one sensor: the current estimates, or all epochs with `history=true`."""

    count: int = _COUNT
    next_cursor: str | None = _CURSOR
    sensor_id: str
    biases: list[BiasEstimate]


class SensorDiagnosis(BaseModel):
    """Probable fault of a sensor."""

    sensor_id: str = Field(description="The sensor, or a source that is not configured")
    code: str = Field(description="Stable code of the cause", examples=["range_unit"])
    sentence: str = Field(description="Human-readable cause and remedy")
    severity: str = Field(
        default="error", description="`error`, or `warning` if the tracks are still usable"
    )


class SensorState(BaseModel):
    """A sensor as configured, with its current state; further members may be added."""

    id: str
    kind: str
    enabled: bool = Field(
        default=True,
        description="Whether the measurements of the sensor are used; if false, they are rejected",
    )
    health: RadarHealth | None = Field(
        default=None, description="Health of a radar, after the first epoch"
    )
    clock_lead_s: float | None = Field(
        default=None,
        description="Time stamps of the sensor minus data time, s, if its last measurements were "
        "rejected because of this difference; null if its clock is correct",
    )
    diagnoses: list[SensorDiagnosis] = Field(
        default=[],
        description="Probable faults of the sensor, its settings or its data, now or at the time "
        "`at`; in a recorded run, the faults of the whole run",
    )


class SensorList(BaseModel):
    """All sensors by identifier."""

    count: int = _COUNT
    sensors: list[SensorState]


class RejectedMeasurement(BaseModel):
    """A row in the quarantine."""

    number: int = Field(description="Number of the row in the quarantine: 1, 2, 3, …")
    journal_sequence: int = Field(description="Journal entry that contains the row")
    source: str = Field(description="Input from which the row was received")
    index: int = Field(description="Index of the row in the message, from 0")
    code: str = Field(description="Stable code of the reason", examples=["OUT_OF_RANGE"])
    reason: str = Field(description="Human-readable reason")
    raw: str = Field(description="Original content; empty if it was not retained")


class RejectPage(BaseModel):
    """A page of the quarantine, oldest first."""

    count: int = _COUNT
    next_after: int | None = Field(description="`after` for the next page; null on the last page")
    rejects: list[RejectedMeasurement]


class Status(BaseModel):
    """Counts, sequence numbers and digests; further members may be added."""

    version: str
    tracks: int = Field(description="Number of live tracks, including tentative tracks")
    tracks_initiated: int = Field(
        description="Number of tracks initiated so far, including tentative tracks"
    )
    tracks_confirmed: int = Field(description="Number of tracks confirmed so far")
    tracks_confirmed_live: int = Field(
        description="Number of live tracks that are or were confirmed"
    )
    tracks_ended: int = Field(description="Number of tracks dropped so far")
    forecast_probability: float = Field(
        description="Containment probability of the counted forecast regions"
    )
    forecasts_counted: int = Field(
        description=(
            "Number of calibrated forecast regions whose time has been reached and whose track "
            "still existed at that time"
        )
    )
    forecasts_held: int = Field(description="Number of counted regions that contained the track")
    retained: dict[str, Any] | None = Field(
        default=None,
        description="Retained data: `first_entry`, `first_time_s` and `used_bytes` of the "
        "journal, the last entry of each of the `snapshots`, and the `archive`",
    )
    history: dict[str, Any] | None = Field(
        default=None,
        description="History on disk: `rows` written and `lost` since the start, by table, size in "
        "`octets`, earliest time `oldest_s`, and `stopped`, the reason why writing has "
        "stopped (empty while the history is written)",
    )
    pages: dict[str, int] = Field(
        description="Number of open air picture pages by client: name of the credentials, or "
        "address"
    )


class Readiness(BaseModel):
    """The service accepts measurements and its output is current."""

    ready: bool


class Health(BaseModel):
    """The process makes progress."""

    status: str


#: Answer of routes to a single resource that may not exist.
NOT_FOUND: dict[int | str, dict[str, Any]] = {404: {"description": "Not found"}}


def table_answers(*, geojson: bool = False) -> dict[int | str, dict[str, Any]]:
    """Return the other media types of a table."""
    content: dict[str, Any] = {ARROW: {"schema": {"type": "string", "format": "binary"}}}
    if geojson:
        content[GEOJSON] = {
            "schema": {"type": "object", "description": "RFC 7946 FeatureCollection"}
        }
    return {200: {"content": content}, 406: {"description": "The response format is not supported"}}
