"""State transitions of tracks, as rows of `transitions.parquet` and in JSON."""

from typing import Annotated, Literal

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema

TransitionName = Literal["started", "confirmed", "coasting", "resumed", "restarted", "ended"]
ReasonName = Literal[
    "new-identity",
    "new-place",
    "updates",
    "likelihood",
    "silent",
    "heard",
    "refused",
    "unconfirmed",
    "unlikely",
    "merged",
]

#: Meaning of each reason.
REASON_MEANINGS: dict[str, str] = {
    "new-identity": "started: no track had this track number or Mode S address.",
    "new-place": "started: a plot without identity was not associated with any track.",
    "updates": "confirmed: the track has an identity and enough updates.",
    "likelihood": "confirmed: the plots of the track are much more likely to come from "
    "an aircraft than from clutter.",
    "silent": "coasting or ended: no measurement for too long.",
    "heard": "resumed: a measurement updated the coasting track.",
    "refused": "restarted: several consecutive measurements were outside the gate, so the track "
    "was reinitialised from them.",
    "unconfirmed": "ended: not confirmed in time.",
    "unlikely": "ended: after missed detections by radars with coverage, the track is as likely to "
    "be clutter as an aircraft.",
    "merged": "ended: duplicate of an older track, `into_track_id`.",
}


class Transition(Record):
    """A state transition of a track; a row of `transitions.parquet`."""

    time_s: Annotated[
        float,
        described(
            "Data time of the detection: time of a measurement, or start of an epoch or window",
            unit="s",
            source="tracker",
        ),
    ]
    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    transition: Annotated[
        TransitionName,
        described(
            "started, confirmed, coasting, resumed, restarted or ended",
            unit="name",
            source="tracker",
        ),
    ]
    reason: Annotated[ReasonName, described("Reason, see below", unit="name", source="tracker")]
    into_track_id: Annotated[
        int | None,
        Field(ge=1),
        described(
            "The track into which it was merged",
            unit="1",
            source="tracker",
            absent="not merged",
        ),
    ]
    last_update_s: Annotated[
        float | None,
        described(
            "Data time of the previous update of the track",
            unit="s",
            source="tracker",
            absent="started",
        ),
    ]


#: `transitions.parquet`: one row for each transition of a track.
TRANSITION_SCHEMA = table_schema(Transition)
