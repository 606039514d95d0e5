"""`report.json`: what a run read, what it refused, what it wrote."""

from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, JsonValue, model_validator

from multiradar_schemas.base import Record, described
from multiradar_schemas.measurements.reject import RejectCode
from multiradar_schemas.rounding import rounded_members

Count = Annotated[int, Field(ge=0)]


def _counted(description: str, absent: str = "never") -> Any:
    return described(description, unit="1", source="run", absent=absent)


class Counts(Record):
    """Everything that was read is one of: accepted, rejected, duplicate."""

    read: Annotated[Count, _counted("Records read, blank lines not among them")]
    accepted: Annotated[Count, _counted("Records taken")]
    rejected: Annotated[Count, _counted("Records refused, one row each in `rejects.ndjson`")]
    duplicate: Annotated[Count, _counted("Records that had been taken before")] = 0
    blank: Annotated[Count, _counted("Blank lines")] = 0

    @model_validator(mode="after")
    def _nothing_is_lost(self) -> Self:
        if self.read != self.accepted + self.rejected + self.duplicate:
            msg = (
                f"expected read = accepted + rejected + duplicate, was "
                f"{self.read} = {self.accepted} + {self.rejected} + {self.duplicate}"
            )
            raise ValueError(msg)
        return self


class InputFile(Record):
    """One file that was read."""

    file: Annotated[str, described("Its name", unit="text", source="run")]
    bytes: Annotated[Count, described("Its size", unit="byte", source="run")]
    counts: Annotated[Counts, described("What became of its records", unit="counts", source="run")]


class OutputFile(Record):
    """One file, or one kind of file, that was written."""

    file: Annotated[str, described("Its name, or a pattern", unit="text", source="run")]
    rows: Annotated[Count, _counted("Its rows")]


class Report(Record):
    """What a run did."""

    command: Annotated[str, described("The command", unit="name", source="run")]
    version: Annotated[str, described("Version of the program", unit="text", source="run")]
    counts: Annotated[Counts, described("Sum over all inputs", unit="counts", source="run")]
    rejected_by_code: Annotated[
        dict[RejectCode, Count], _counted("Refusals by code; they add up to `counts.rejected`")
    ]
    inputs: Annotated[
        list[InputFile], described("The files read", unit="list", source="run", absent="never")
    ]
    outputs: Annotated[list[OutputFile], described("The files written", unit="list", source="run")]
    output_sha256: Annotated[
        str | None,
        described(
            "Digest of all track updates and biases, the same offline and live",
            unit="64 hexadecimal digits",
            source="tracker",
            absent="a conversion",
        ),
    ] = None
    settings: Annotated[
        dict[str, JsonValue],
        described("The settings that shape the output", unit="by name", source="run"),
    ] = Field(default_factory=dict)
    figures: Annotated[
        dict[str, JsonValue],
        AfterValidator(rounded_members),
        described(
            "Further figures, named with their unit, rounded below their error. Of `track` also "
            "`tracks`, all that were initiated, those of them that were confirmed as "
            "`tracks_confirmed`, `final_biases`, and "
            "`unobservable_biases`: combinations of biases of which the measurements told nothing, "
            "each with `what` it is, its `prior_ratio` (sigma over that beforehand) and the "
            "`weights` of its parameters in prior sigmas; and `track_transitions`: how often "
            "tracks without identity were `started`, `confirmed`, `ended_unconfirmed`, "
            "`ended_silent` (no plots, or a score like that of false ones) and `merged` into an "
            "older one; `duplicates_by_sensor`; `arrivals`: of each sensor, how many measurements "
            "came, how many `late` or from the `future`, and how far behind the data time half and "
            "99 % of them came, s; `sensor_health`, the last row of `health.parquet` of each "
            "radar, and `sensor_alarms`: the `time_s`, the `sensor_id` and the `alarm` of each "
            "that began; `warnings` in words; and `diagnoses`: what is probably wrong, each with "
            "the `sensor_id` (empty when it is about all), a `code` such as `range_unit`, and a "
            "`sentence` with the cause and what to do",
            unit="by name",
            source="run",
        ),
    ] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _codes_add_up(self) -> Self:
        total = sum(self.rejected_by_code.values())
        if total != self.counts.rejected:
            msg = f"expected {self.counts.rejected} refusals by code, was {total}"
            raise ValueError(msg)
        return self
