"""`report.json`: what a run read, rejected and wrote."""

from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, JsonValue, model_validator

from multiradar_schemas.base import Record, described
from multiradar_schemas.reject import RejectCode
from multiradar_schemas.rounding import rounded_members

Count = Annotated[int, Field(ge=0)]


def _counted(description: str, absent: str = "never") -> Any:
    return described(description, unit="1", source="run", absent=absent)


class Counts(Record):
    """Counts of records; every record read is accepted, rejected or duplicate."""

    read: Annotated[Count, _counted("Records read, excluding blank lines")]
    accepted: Annotated[Count, _counted("Records accepted")]
    rejected: Annotated[Count, _counted("Records rejected, each with a line in `rejects.ndjson`")]
    duplicate: Annotated[Count, _counted("Records that were already accepted")] = 0
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
    """An input file."""

    file: Annotated[str, described("Name of the file", unit="text", source="run")]
    bytes: Annotated[Count, described("Size of the file", unit="byte", source="run")]
    counts: Annotated[
        Counts, described("Disposition of the records of the file", unit="counts", source="run")
    ]


class OutputFile(Record):
    """An output file, or a kind of output files."""

    file: Annotated[str, described("Name of the file, or a pattern", unit="text", source="run")]
    rows: Annotated[Count, _counted("Number of rows in the file")]


class Report(Record):
    """Report of a run."""

    command: Annotated[str, described("The command", unit="name", source="run")]
    version: Annotated[str, described("Version of the program", unit="text", source="run")]
    counts: Annotated[Counts, described("Sum over all inputs", unit="counts", source="run")]
    rejected_by_code: Annotated[
        dict[RejectCode, Count], _counted("Rejects by code; their sum is `counts.rejected`")
    ]
    inputs: Annotated[
        list[InputFile], described("The files read", unit="list", source="run", absent="never")
    ]
    outputs: Annotated[list[OutputFile], described("The files written", unit="list", source="run")]
    output_sha256: Annotated[
        str | None,
        described(
            "Digest of all track updates and biases, identical offline and live",
            unit="64 hexadecimal digits",
            source="tracker",
            absent="conversions",
        ),
    ] = None
    settings: Annotated[
        dict[str, JsonValue],
        described("The settings that affect the output", unit="by name", source="run"),
    ] = Field(default_factory=dict)
    figures: Annotated[
        dict[str, JsonValue],
        AfterValidator(rounded_members),
        described(
            "Additional figures; names include the unit, and the rounding of values is smaller "
            "than their error. For `track`, these include `tracks`, the number of initiated "
            "tracks, and `tracks_confirmed`, the number of tracks that were confirmed; "
            "`final_biases`; `unobservable_biases`: combinations of biases that the measurements "
            "do not determine, each with its description `what`, its `prior_ratio` (sigma / "
            "prior sigma), the `reason` if there is no information at all, and the `weights` of "
            "its parameters in prior sigmas; `aircraft_delays` if transponder delays are "
            "estimated: number of `tracks` and of `observed` delays (sigma below half the prior "
            "sigma), with their `mean_m`, `scatter_m` and `median_sigma_m`; `track_transitions`: "
            "the number of times that tracks were `started`, `confirmed`, `ended_unconfirmed`, "
            "`ended_silent` (no plots, or a score typical of a false track) and `merged` into an "
            "older one; `duplicates_by_sensor`; `arrivals`: for each sensor, the number of "
            "measurements, the number of `late` measurements and of measurements in the "
            "`future`, and the median and 99th percentile of the delay relative to data time, s; "
            "`sensor_health`, the last row of `health.parquet` for each radar; `sensor_alarms`: "
            "`time_s`, `sensor_id` and `alarm` of each alarm raised; `warnings` as sentences; "
            "and `diagnoses`: probable faults, each with a `sensor_id` (empty if the fault "
            "concerns all sensors), a `code` such as `range_unit`, a `sentence` with the cause "
            "and the remedy, and a `severity`, `error` or `warning`. For `reprocess`: `days`, "
            "each with its `region`, `day`, `status` (made, kept or failed), `reason`, times, "
            "`start` (the day from whose biases it started), digest, `findings` and `warnings`; "
            "`tests`: whether biases are the same on all days, for a region (empty `sensor_id`) "
            "and for each sensor, with the `chi2` of all biases including their correlations, "
            "`degrees_of_freedom` and `p_value`",
            unit="by name",
            source="run",
        ),
    ] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _codes_add_up(self) -> Self:
        total = sum(self.rejected_by_code.values())
        if total != self.counts.rejected:
            msg = f"expected the rejects by code to sum to {self.counts.rejected}, was {total}"
            raise ValueError(msg)
        return self
