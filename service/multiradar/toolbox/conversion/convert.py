"""Recordings in other formats as measurements."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack

from multiradar.errors import (
    ArgumentError,
    DataWarning,
    FindingsError,
    InputError,
    OutputExistsError,
)
from multiradar.runtime.heap import share_heap
from multiradar.toolbox.arguments import typed, unknown_argument
from multiradar.toolbox.compiling import compile_kernels
from multiradar.toolbox.conversion.dump_points import track_points
from multiradar.toolbox.conversion.incomplete import incomplete
from multiradar.toolbox.diagnoses import findings_of, notes_of
from multiradar.toolbox.inputs import (
    DumpChoice,
    check_sensors_argument,
    parse_day,
    read_sensors,
)
from multiradar.toolbox.messages.progress import progress_bar
from multiradar.toolbox.messages.warning import warn
from multiradar.toolbox.output import Output, PathLike, new_output, remove_with
from multiradar_schemas.documents.names import did_you_mean, unknown

if TYPE_CHECKING:
    import polars as pl

    from multiradar_converters.vid.options import Options
    from multiradar_schemas.sensors.sensor import SensorsFile


class ConvertOptions(TypedDict, total=False):
    """Options of `convert`, by the formats that use them.

    date : str
        Date on which the recording starts, YYYY-MM-DD; without it times are times of day.
    profile, allow_missing : path, bool
        vid: layout of the dump; whether it may lack tracks.txt or plots_ads.txt.
    aircraft_max, ads_measurements_min, sensor_only, track_measurements_min, kinds
        vid: what goes into the track files; see ``multiradar convert vid --help``.
    sensors : path or SensorsFile
        asterix: sensor ids by SAC and SIC.
    edition : sequence of str
        asterix: editions of categories, such as ``021=0.26`` or ``20-130/048=1.15``.
    reference : sequence of str
        asterix: reference points of local coordinates, ``SAC-SIC=LATITUDE,LONGITUDE``, degrees.
    all_targets, records : bool
        asterix: include test targets and the like; write every field of every record.
    utc_offset : float
        adsb: local time of BaseStation messages minus UTC, hours.
    recover : sequence of str
        journal: codes of rejects that are read as measurements, such as ``UNKNOWN_SENSOR``.
    from_s, until_s : float
        journal: only measurements at or after the first and before the second time, Unix time, s.
    """

    date: str | None
    profile: PathLike | None
    allow_missing: bool
    aircraft_max: int | None
    ads_measurements_min: int
    sensor_only: int | None
    track_measurements_min: int
    kinds: Sequence[str] | None
    sensors: "PathLike | SensorsFile | None"
    edition: Sequence[str]
    reference: Sequence[str]
    all_targets: bool
    records: bool
    utc_offset: float
    recover: Sequence[str]
    from_s: float
    until_s: float


_OF_FORMAT = {
    "vid": (
        "date", "profile", "allow_missing", "aircraft_max", "ads_measurements_min", "sensor_only",
        "track_measurements_min", "kinds",
    ),
    "asterix": ("date", "sensors", "edition", "reference", "all_targets", "records"),
    "adsb": ("date", "utc_offset"),
    "journal": ("recover", "from_s", "until_s"),
}  # fmt: skip


class Conversion(Output):
    """A converted recording.

    Parameters
    ----------
    folder : str or Path
        A folder that `convert` made.

    Raises
    ------
    InputError
        There is no such folder.
    """

    _wanted = "the output of `convert`"

    def __repr__(self) -> str:
        """Return the counts."""
        counts = self.report["counts"]
        return (
            f"Conversion({counts['read']} read = {counts['accepted']} accepted + "
            f"{counts['rejected']} rejected + {counts['duplicate']} duplicate, {self.folder})"
        )

    @property
    def measurements(self) -> "pl.DataFrame":
        """The measurements; columns and units as in docs/reference/fields.md."""
        return self.table("measurements")


@typed
def convert(
    recordings: PathLike | Iterable[PathLike],
    *,
    out: PathLike | None = None,
    format: Literal["vid", "asterix", "adsb", "journal"] | None = None,
    **options: Unpack[ConvertOptions],
) -> Conversion:
    """Convert a recording into measurements.

    Parameters
    ----------
    recordings : path, or several
        A dump directory, ASTERIX files, ADS-B files, or the state or archive of a service; several
        files are one recording.
    out : path, optional
        Folder to make; by default a temporary one, removed with the result.
    format : {"vid", "asterix", "adsb", "journal"}, optional
        Detected by default.
    **options
        See `ConvertOptions`.

    Returns
    -------
    Conversion
        `.measurements`, `.report` and `.folder`.

    Raises
    ------
    InputError
        A file cannot be read; nothing was written.
    OutputExistsError
        `out` exists.
    ArgumentError
        An option has an invalid value, or does not apply to this format.
    FindingsError
        The recording is truncated or at fault; what was read is in `.output`.
    """
    given = [recordings] if isinstance(recordings, str | Path) else recordings
    paths = [Path(one) for one in given]
    if not paths:
        raise ArgumentError("`recordings`: expected at least one, found none", "recordings")
    chosen = format or detected(paths[0])
    _check_options(chosen, options)
    folder = new_output(out)
    report = _CONVERT[chosen](paths, folder, options)
    done = Conversion(folder)
    if out is None:
        remove_with(done, folder)
    # The conversion itself is complete.
    for sentence in notes_of(chosen, paths, report, folder):
        warn(sentence, DataWarning)
    if findings := _findings(chosen, report, folder, options):
        raise FindingsError(findings, done)
    return done


def _check_options(chosen: str, options: Iterable[str]) -> None:
    if chosen not in _OF_FORMAT:
        meant = did_you_mean(chosen, _OF_FORMAT)
        msg = f"`format`: expected {', '.join(_OF_FORMAT)}, was {chosen!r}{meant}"
        raise ArgumentError(msg, "format")
    for name in options:
        if name in _OF_FORMAT[chosen]:
            continue
        if not any(name in names for names in _OF_FORMAT.values()):
            raise unknown_argument(name, _OF_FORMAT[chosen])
        raise ArgumentError(f"`{name}` does not apply to the format {chosen}", name)


def detected(path: Path) -> str:
    """Return the format of a recording.

    Raises
    ------
    InputError
        It is not there, or of no known format.
    """
    from multiradar.toolbox.operation.backups import is_journal
    from multiradar_converters.errors import ConversionError
    from multiradar_converters.inspection.recordings import recording_kind

    if not path.exists():
        raise InputError(f"{path}: no such file")
    if is_journal(path):
        return "journal"
    try:
        kind = recording_kind(path)
    except ConversionError as error:
        raise InputError(str(error)) from error
    return "vid" if kind == "dump" else kind


def convert_dump(dump: Path, out: Path, options: "Options") -> dict[str, Any]:
    """Convert a dump, with a progress bar on a terminal.

    Parameters
    ----------
    dump, out : Path
        Folder of the dump, and the folder to make.
    options : Options
        The user's choices.

    Returns
    -------
    dict
        Contents of `report.json`.

    Raises
    ------
    OutputExistsError
        `out` exists; nothing was touched.
    InputError
        The dump cannot be read; `out` does not exist.
    """
    share_heap()
    compile_kernels(["convert vid"])
    from multiradar_converters.vid.conversion import PASSES, convert
    from multiradar_converters.vid.survey import dump_bytes

    with conversion_errors(), bytes_bar(PASSES * dump_bytes(dump, options)) as advance:
        return convert(dump, out, options, advance)


def convert_files(
    kind: str,
    files: Sequence[Path],
    convert: Callable[[Callable[[int], None]], dict[str, object]],
) -> dict[str, Any]:
    """Convert files, with a progress bar on a terminal.

    Parameters
    ----------
    kind : str
        asterix or adsb.
    files : sequence of Path
        What is converted.
    convert : callable
        Converts; its argument is to be called with the bytes read since the last call.

    Returns
    -------
    dict
        Contents of `report.json`.

    Raises
    ------
    OutputExistsError
        The output folder exists; nothing was touched.
    InputError
        A file cannot be read; no output folder was created.
    ArgumentError
        A file is given twice.
    """
    from multiradar_converters.inspection.recordings import check_recording

    given: set[Path] = set()
    for path in files:
        if path.resolve() in given:
            raise ArgumentError(f"{path}: given twice")
        given.add(path.resolve())
    with conversion_errors():
        for path in files:
            check_recording(path)
    for path in files:
        if path.is_dir():
            raise InputError(f"{path}: expected a file, was a folder; specify the files in it")
        if not path.exists():
            raise InputError(f"{path}: no such file")
    compile_kernels([f"convert {kind}"])
    total = sum(path.stat().st_size for path in files if path.is_file())
    with conversion_errors(), bytes_bar(total) as advance:
        return convert(advance)


@contextmanager
def conversion_errors() -> Iterator[None]:
    """Raise errors of a conversion as errors of this package.

    Raises
    ------
    OutputExistsError
        The output folder exists; nothing was touched.
    InputError
        The input cannot be read; no output folder was created.
    """
    # Imported here: help must be fast.
    from multiradar_converters.errors import ConversionError, OutputFolderExistsError

    try:
        yield
    except OutputFolderExistsError as error:
        raise OutputExistsError(str(error)) from error
    except ConversionError as error:
        raise InputError(str(error)) from error


@contextmanager
def bytes_bar(total: int) -> Iterator[Callable[[int], None]]:
    """Show the progress of a conversion.

    Parameters
    ----------
    total : int
        Bytes in all.

    Yields
    ------
    callable
        To be called with the number of bytes read since the last call.
    """
    with progress_bar("converting", total) as show:
        done = 0

        def advance(read: int) -> None:
            nonlocal done
            done += read
            show(done)

        yield advance


def _vid(paths: list[Path], out: Path, options: ConvertOptions) -> dict[str, Any]:
    from multiradar_converters.vid.options import TRACK_KINDS

    if len(paths) > 1:
        raise ArgumentError(f"{paths[1]}: a dump must be converted separately")
    names = ("aircraft_max", "ads_measurements_min", "sensor_only", "track_measurements_min")
    more: dict[str, Any] = {name: options[name] for name in names if name in options}  # type: ignore[literal-required]  # as listed
    kinds = options.get("kinds")
    if kinds is not None:
        for kind in kinds:
            if kind not in TRACK_KINDS:
                msg = f"`kinds`: expected {', '.join(TRACK_KINDS)}, was {kind!r}"
                raise ArgumentError(msg, "kinds")
        more["kinds"] = tuple(kinds)
    profile = options.get("profile")
    dump = DumpChoice(
        options.get("date"),
        None if profile is None else Path(profile),
        options.get("allow_missing", False),
    )
    return convert_dump(paths[0], out, dump.options(**more))


def _asterix(paths: list[Path], out: Path, options: ConvertOptions) -> dict[str, Any]:
    from multiradar_converters.asterix.conversion import convert
    from multiradar_converters.asterix.decoding.editions import parse_editions
    from multiradar_converters.asterix.decoding.local_plane import parse_references
    from multiradar_converters.asterix.options import Options
    from multiradar_converters.errors import ProfileError

    try:
        editions = parse_editions([*options.get("edition", ())])
    except ProfileError as error:
        raise ArgumentError(f"`edition`: {error}", "edition") from error
    try:
        references = parse_references([*options.get("reference", ())])
    except ProfileError as error:
        raise ArgumentError(f"`reference`: {error}", "reference") from error
    wanted = Options(
        sensors=_sensors(options),
        date=parse_day(options.get("date")),
        editions=editions,
        all_targets=options.get("all_targets", False),
        records=options.get("records", False),
        references=references,
    )
    return convert_files("asterix", paths, lambda advance: convert(paths, out, wanted, advance))


def _adsb(paths: list[Path], out: Path, options: ConvertOptions) -> dict[str, Any]:
    from multiradar_converters.adsb.conversion import convert
    from multiradar_converters.adsb.options import Options

    day, offset_h = parse_day(options.get("date")), options.get("utc_offset", 0.0)
    if not -14.0 <= offset_h <= 14.0:
        msg = f"`utc_offset`: expected a number from -14 to 14 (hours), was {offset_h}"
        raise ArgumentError(msg, "utc_offset")
    wanted = Options(date=day, utc_offset_h=offset_h)
    return convert_files("adsb", paths, lambda advance: convert(paths, out, wanted, advance))


def _journal(paths: list[Path], out: Path, options: ConvertOptions) -> dict[str, Any]:
    from multiradar.storage.entries import RECOVERABLE
    from multiradar.toolbox.conversion.journal import convert_journal
    from multiradar_schemas.reject import RejectCode

    if len(paths) > 1:
        raise ArgumentError(f"{paths[1]}: a journal must be converted separately")
    codes = []
    for name in options.get("recover", ()):
        if name not in RECOVERABLE:
            raise ArgumentError(f"`recover`: {unknown('code', name, RECOVERABLE)}", "recover")
        codes.append(RejectCode(name))
    begin_s, end_s = options.get("from_s", -math.inf), options.get("until_s", math.inf)
    if not begin_s < end_s:
        msg = f"`from_s`: expected a time before `until_s` ({end_s} s), was {begin_s} s"
        raise ArgumentError(msg, "from_s")
    return convert_journal(paths[0], out, codes, begin_s, end_s)


_CONVERT = {"vid": _vid, "asterix": _asterix, "adsb": _adsb, "journal": _journal}


def _sensors(options: ConvertOptions) -> "SensorsFile | None":
    given = options.get("sensors")
    if given is not None:
        check_sensors_argument(given)
    return read_sensors(Path(given)) if isinstance(given, str | Path) else given


def _findings(kind: str, report: dict[str, Any], out: Path, options: ConvertOptions) -> list[str]:
    """Return what makes a conversion incomplete or suspect; the most important alone."""
    if kind == "journal":
        # The service has diagnosed its sensors, and `track` will.
        return []
    from multiradar import wire
    from multiradar.diagnosis.conversion import diagnose_conversion
    from multiradar.storage.recording import MEASUREMENTS_FILE

    if found := incomplete(kind, report, out):
        return [found]
    sensors = _sensors(options)
    table = None if sensors is None else wire.sensor_table(sensors)
    tracks = track_points(out, report) if kind == "vid" else None
    diagnoses = diagnose_conversion(out / MEASUREMENTS_FILE, report, table, tracks)
    return findings_of(diagnoses)
