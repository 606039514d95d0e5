"""Steps in the life of a track, as rows of `transitions.parquet` and as JSON."""

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

#: What each reason says, one sentence each.
REASON_MEANINGS: dict[str, str] = {
    "new-identity": "started: a track number or Mode S address that no track had.",
    "new-place": "started: a plot without identity that was of no track.",
    "updates": "confirmed: enough updates of a track that is known by identity.",
    "likelihood": "confirmed: an aircraft explains the plots of the track much better than "
    "false plots do.",
    "silent": "coasting or ended: no measurement for too long.",
    "heard": "resumed: a measurement came while the track was coasting.",
    "refused": "restarted: several measurements in a row did not fit, so the track began anew "
    "where they are.",
    "unconfirmed": "ended: it did not become confirmed in time.",
    "unlikely": "ended: the radars that should see it did not, so that false plots explain it "
    "as well.",
    "merged": "ended: an older track, `into_track_id`, is of the same aircraft.",
}


class Transition(Record):
    """A step in the life of a track; a row of `transitions.parquet`."""

    time_s: Annotated[
        float,
        described(
            "Data time at which it was noticed: of a measurement, or of the beginning of an epoch "
            "or window",
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
    reason: Annotated[ReasonName, described("Why, see below", unit="name", source="tracker")]
    into_track_id: Annotated[
        int | None,
        Field(ge=1),
        described(
            "The track that stands for it from now on",
            unit="1",
            source="tracker",
            absent="not merged",
        ),
    ]
    last_update_s: Annotated[
        float | None,
        described(
            "Data time of the update of the track before this",
            unit="s",
            source="tracker",
            absent="started",
        ),
    ]


#: `transitions.parquet`: one row for each transition of a track.
TRANSITION_SCHEMA = table_schema(Transition)
