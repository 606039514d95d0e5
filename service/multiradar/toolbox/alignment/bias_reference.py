"""`multiradar track --reference`: system tracks of another processor as a reference."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from multiradar.errors import ConfigurationError, InputError
from multiradar_converters.leftovers import temporary_folder
from multiradar_schemas.documents.contents import no_such

if TYPE_CHECKING:
    import polars as pl
    from pydantic import JsonValue

    from multiradar.diagnosis.model import Diagnosis
    from multiradar.evaluation.bias_reference import ReferenceCounts
    from multiradar.storage.recording import Recording
    from multiradar_schemas.sensors.sensor import Sensor, SensorsFile

TRACKS_FILE, SYSTEM_TRACKS_FILE = "tracks.parquet", "system_tracks.parquet"
REPORTED_BIASES_FILE = "reported_biases.parquet"
_KIND: Literal["mlat"] = "mlat"


@dataclass(frozen=True, slots=True, eq=False)
class BiasReference:
    """System tracks of another processor, as a sensor of positions.

    Attributes
    ----------
    path : Path
        As it was given.
    updates : DataFrame
        Measured updates of confirmed tracks.
    sensor : Sensor
        The sensor of the reference.
    added : bool
        Whether the sensors file has no such sensor.
    processor : str, optional
        `sensor_id` of the processor, if it was chosen.
    """

    path: Path
    updates: "pl.DataFrame"
    sensor: "Sensor"
    added: bool
    processor: str | None = None

    @property
    def late(self) -> bool:
        """Whether the offset of its times is estimated."""
        return bool(self.sensor.bias.time_offset_s.estimate)

    def among(self, sensors: "SensorsFile") -> "SensorsFile":
        """Return the sensors with that of the reference."""
        if not self.added:
            return sensors
        return sensors.model_copy(update={"sensor": (*sensors.sensor, self.sensor)})

    def without_heights(self, found: "Sequence[Diagnosis]") -> "list[Diagnosis]":
        """Return diagnoses but that of its heights, which are left out of its positions."""
        from multiradar.diagnosis.same_aircraft.height_levels import HEIGHTS_MISSING_CODE

        return [
            one
            for one in found
            if one.sensor_id != self.sensor.id or one.code != HEIGHTS_MISSING_CODE
        ]

    def append_to(self, file: Path) -> None:
        """Append the sensor to a `sensors.toml` that lacks it."""
        if self.added:
            with file.open("a", encoding="utf-8") as copy:
                copy.write(
                    f"\n# System tracks, specified with --reference.\n[[sensor]]\nid = "
                    f'"{self.sensor.id}"\n'
                    f'kind = "{self.sensor.kind}"\n'
                    f"position_sigma_m = {self.sensor.position_sigma_m}\n"
                    f"bias.time_offset_s.estimate = {str(self.late).lower()}\n"
                )


@dataclass(frozen=True, slots=True, eq=False)
class Referenced:
    """Measurements with those of a bias reference.

    Attributes
    ----------
    recording : Recording
        The measurements of both.
    counts : ReferenceCounts, optional
        Disposition of the updates of the reference; None without one.
    shared : list of str
        Radars of the measurements that the processor of the reference uses by its own reports.
    """

    recording: "Recording"
    counts: "ReferenceCounts | None" = None
    shared: list[str] = field(default_factory=list)

    def figures(self) -> "dict[str, JsonValue]":
        """Return counts and radars for `report.json`; nothing without a reference."""
        if self.counts is None:
            return {}
        return {**asdict(self.counts), "processor_uses": [*self.shared]}

    def sentences(self, reference: BiasReference | None) -> list[str]:
        """Return what was used of the reference, and what the biases are relative to."""
        counts = self.counts
        if counts is None or reference is None:
            return []
        note = "if its processor uses the same radars, its registration errors are included"
        if self.shared:
            names = ", ".join(self.shared)
            note = f"its processor uses {names}, whose registration errors cannot be detected"
        return [
            f"reference {reference.path}: {counts.used} of {counts.read} updates used, sigma "
            f"{reference.sensor.position_sigma_m:.0f} m on each axis ({counts.turning} not in "
            f"straight flight, {counts.not_measured} without a plot, {counts.dependent} too close "
            f"to the preceding update); biases are relative to this reference: {note}"
        ]


def read_reference(
    given: Path | None, sensors: "SensorsFile", processor: str | None = None, *, late: bool
) -> BiasReference | None:
    """Read system tracks for `with_reference`; None without any.

    Parameters
    ----------
    given : Path, optional
        The folder that `convert` or `track` made, or a table of it.
    sensors : SensorsFile
        The sensors of the measurements.
    processor : str, optional
        `sensor_id` of the processor; needed if there are several.
    late : bool
        Whether its times may be off, unless the sensors file says otherwise.

    Raises
    ------
    InputError
        It is missing or cannot be used.
    ConfigurationError
        The sensors file has another kind of sensor of this name.
    """
    if given is None:
        return None
    from multiradar.evaluation.bias_reference import REFERENCE_ID, own_sigma_m
    from multiradar_schemas.sensors.bias import SensorBias, TimeOffset
    from multiradar_schemas.sensors.sensor import Sensor

    updates = _updates(given, processor)
    for one in sensors.sensor:
        if REFERENCE_ID in one.all_names():
            if one.kind != _KIND:
                msg = f"sensor {REFERENCE_ID}: expected kind {_KIND}, was {one.kind}"
                raise ConfigurationError(msg)
            return BiasReference(given, updates, one, added=False, processor=processor)
    sigma_m = round(own_sigma_m(updates), 1)
    bias = SensorBias(time_offset_s=TimeOffset(estimate=late))
    sensor = Sensor(id=REFERENCE_ID, kind=_KIND, position_sigma_m=sigma_m, bias=bias)
    return BiasReference(given, updates, sensor, added=True, processor=processor)


@contextmanager
def with_reference(
    recording: "Recording",
    reference: BiasReference | None,
    sensors: "SensorsFile",
    kinds: Collection[str] | None,
) -> Iterator[Referenced]:
    """Add system tracks to measurements.

    Parameters
    ----------
    recording : Recording
        The measurements.
    reference : BiasReference, optional
        The system tracks; without them the measurements stay as they are.
    sensors : SensorsFile
        The sensors of the measurements.
    kinds : collection of str, optional
        Kinds of measurement to use; all by default.

    Yields
    ------
    Referenced
        With temporary files, which are removed afterwards.

    Raises
    ------
    InputError
        A file cannot be read, or no update can be used.
    """
    if reference is None:
        yield Referenced(recording)
        return
    import polars as pl

    from multiradar.evaluation.bias_reference import IDENTITIES, reference_measurements

    known = {name: one.id for one in sensors.sensor for name in one.all_names()}
    plots = pl.concat(
        block.filter(pl.col("sensor_id").is_in(sorted(known))).select("time_s", *IDENTITIES)
        for block in recording.blocks({"radar", "bearing"})
    )
    made, counts = reference_measurements(
        reference.updates, plots, reference.sensor.position_sigma_m
    )
    if not counts.used:
        msg = (
            f"{reference.path}: none of {counts.read} updates can be used as a bias reference: "
            f"{counts.turning} not in straight flight, {counts.not_measured} without a plot of "
            "the same address, code or number at that time; check that times and areas overlap"
        )
        raise InputError(msg)
    shared = [known[name] for name in _used_radars(reference) if name in known]
    with temporary_folder("multiradar-reference-") as folder:
        merged = _merged(recording, made, folder / "merged.parquet", kinds)
        yield Referenced(merged, counts, shared)


def _merged(
    recording: "Recording", made: "pl.DataFrame", file: Path, kinds: Collection[str] | None
) -> "Recording":
    import polars as pl

    from multiradar.evaluation.bias_reference import REFERENCE_ID
    from multiradar.storage.recording import INDEX_COLUMN
    from multiradar.storage.table_writer import TableWriter
    from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA

    schema = pl.Schema({**MEASUREMENT_SCHEMA, INDEX_COLUMN: pl.get_index_type()})
    added = made.with_columns(
        pl.lit(REFERENCE_ID).alias("sensor_id"),
        pl.lit(_KIND).alias("kind"),
        *(
            pl.lit(None, dtype).alias(name)
            for name, dtype in schema.items()
            if name not in {*made.columns, "sensor_id", "kind", INDEX_COLUMN}
        ),
    ).with_row_index(INDEX_COLUMN, offset=recording.rows)
    added = added.select(pl.col(name).cast(dtype) for name, dtype in schema.items())
    writer, rows, begin_s = TableWriter(file, schema), 0, float("-inf")
    for block in recording.blocks(kinds):
        latest = block["time_s"].max()
        end_s = latest if isinstance(latest, float) else begin_s
        between = added.filter((pl.col("time_s") > begin_s) & (pl.col("time_s") <= end_s))
        part = pl.concat([block.select(list(schema)), between]).sort("time_s", maintain_order=True)
        writer.append(part)
        rows, begin_s = rows + len(part), max(begin_s, end_s)
    rest = added.filter(pl.col("time_s") > begin_s)
    writer.append(rest)
    writer.finish()
    return recording.with_rows_of(file, rows + len(rest))


def _updates(given: Path, processor: str | None) -> "pl.DataFrame":
    """Return measured updates of confirmed tracks, with `flight` and identities."""
    import polars as pl

    from multiradar.errors import MissingColumnError
    from multiradar.evaluation.system_tracks import named_by_flight, of_one_processor
    from multiradar.toolbox.diagnoses import NOT_SEEN
    from multiradar.toolbox.evaluation.recorded import dump_tracks, has_dump_tracks
    from multiradar.toolbox.evaluation.tracked import read_table

    path = given
    if given.is_dir():
        names = (SYSTEM_TRACKS_FILE, TRACKS_FILE)
        path = next((given / one for one in names if (given / one).is_file()), given)
    if path.is_dir() or path.suffix == ".new4":
        if not has_dump_tracks(given):
            raise InputError(no_such(given, f"a folder with {SYSTEM_TRACKS_FILE} or {TRACKS_FILE}"))
        frame = dump_tracks(given).with_columns(
            flight=pl.col("track_number").cast(pl.String), mode_3a=pl.lit(None, pl.String)
        )
        return frame.drop_nulls("flight")
    frame = read_table(path, "system tracks (of `convert asterix` or `track`)")
    needed = ("time_s", "latitude_deg", "longitude_deg", "state", "mode_s_address", "mode_3a")
    missing = [name for name in needed if name not in frame.columns]
    if missing:
        raise MissingColumnError(str(path), missing, frame.columns)
    located = frame.drop_nulls(["time_s", "latitude_deg", "longitude_deg"])
    if "track_id" in frame.columns:
        named = located.with_columns(flight=pl.col("track_id").cast(pl.String))
        if "track_number" not in frame.columns:
            named = named.with_columns(track_number=pl.lit(None, pl.Int64))
    else:
        if "track_number" not in frame.columns or "sensor_id" not in frame.columns:
            absent = [one for one in ("track_number", "sensor_id") if one not in frame.columns]
            raise MissingColumnError(str(path), absent, frame.columns)
        own = of_one_processor(frame.drop_nulls("time_s"), str(path), processor)
        named = named_by_flight(own.sort("time_s", maintain_order=True))
        named = named.with_columns(flight=pl.col("track_number"))
        # The numbers of the processor are not those of the plots.
        named = named.with_columns(track_number=pl.lit(None, pl.Int64))
    confirmed = ~pl.col("state").is_in([*NOT_SEEN, "tentative"])
    return named.filter(confirmed).drop_nulls("flight")


def _used_radars(reference: BiasReference) -> list[str]:
    """Return the radars of which the processor reports biases, in the same recording."""
    import polars as pl

    given = reference.path
    file = (given if given.is_dir() else given.parent) / REPORTED_BIASES_FILE
    if not file.is_file():
        return []
    reported = pl.read_parquet(file)
    if reference.processor is not None:
        reported = reported.filter(processor_id=reference.processor)
    return sorted(reported["sensor_id"].unique().to_list())
