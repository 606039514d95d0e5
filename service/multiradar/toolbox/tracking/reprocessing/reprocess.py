"""Tracking of days of archives, one by one, and the comparison of their biases."""

import fcntl
import hashlib
import json
import os
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from multiradar.errors import ArgumentError, FindingsError, InputError, OutputExistsError
from multiradar.toolbox.arguments import typed
from multiradar.toolbox.compiling import compile_kernels
from multiradar.toolbox.inputs import SENSORS_FILE, load_sensor_table
from multiradar.toolbox.messages.progress import job_bars, progress_bar
from multiradar.toolbox.output import PathLike
from multiradar.toolbox.settings import check_count
from multiradar.toolbox.tracking.earlier_run import OVERLAP_MAX_S
from multiradar.toolbox.tracking.reprocessing.days import (
    Day,
    check_apart,
    find_days,
    input_sha256,
)
from multiradar.toolbox.tracking.reprocessing.job import day_job, run_day
from multiradar.toolbox.tracking.reprocessing.outputs import Region, write_outputs
from multiradar.toolbox.tracking.reprocessing.records import (
    RECORD_FILE,
    read_json,
    read_record,
    write_json,
)
from multiradar.toolbox.tracking.reprocessing.schedule import (
    FAILED,
    KEPT,
    Chain,
    Outcome,
    Schedule,
    Start,
)
from multiradar.toolbox.tracking.request import TrackOptions, TrackRequest, track_request
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    from multiradar.cluster.jobs import Jobs

INDEPENDENT, CHAINED, MERGED = "independent", "chained", "merged"
#: How the biases of days depend on each other.
DAYS = (INDEPENDENT, CHAINED, MERGED)
#: Options of `track` that are of one recording, or that this command sets.
_OF_ONE_RUN = (
    "date", "workers", "batch", "biases_from", "reference", "processor", "asterix", "report",
)  # fmt: skip
_WORKER = "multiradar.toolbox.tracking.reprocessing.worker"
_THREADS_MAX = 8


@dataclass(frozen=True, slots=True)
class Reprocessed:
    """The output of `reprocess`.

    Attributes
    ----------
    folder : Path
        The output directory.
    report : dict
        Contents of its `report.json`.
    """

    folder: Path
    report: dict[str, Any]


@typed
def reprocess(
    folder: PathLike,
    sensors: PathLike,
    *,
    out: PathLike,
    days: str = INDEPENDENT,
    jobs: int | None = None,
    again: bool = False,
    on_end: Callable[[Outcome], None] = lambda _outcome: None,
    runner: "Jobs | None" = None,
    filter: str | None = None,
    kinds: Collection[str] | None = None,
    hide: Collection[str] | None = None,
    **options: Unpack[TrackOptions],
) -> Reprocessed:
    """Track the days of a folder, each by a run of `track` in a process, and compare their biases.

    Days that are complete, of the same inputs and settings, are kept.

    Parameters
    ----------
    folder : path
        With folders of days such as 2026-11-20, or with folders of regions that have them.
    sensors : path
        A `sensors.toml`; that in the folder of a region takes precedence.
    out : path
        The output directory, outside the folder; continued if it exists.
    days : str
        independent: each day starts from the priors; chained: from the biases of the day before;
        merged: as independent, and the biases of all days as priors in a sensors file.
    jobs : int, optional
        Days at a time; as many as processors by default.
    again : bool
        Make all days again whose settings differ, instead of an error.
    on_end : callable
        Called with the outcome of each day.
    runner : Jobs, optional
        Runs the days in place of processes of this host or tasks of Ray; closed at the end.
    filter, kinds, hide, **options
        As of `track`, apart from those of one recording.

    Returns
    -------
    Reprocessed
        The output directory and its report.

    Raises
    ------
    InputError
        There are no days.
    ConfigurationError
        An argument or setting cannot be used.
    OutputExistsError
        `out` is another folder, in use, or of other settings.
    FindingsError
        Days failed or have findings; the output is in `.output`.
    """
    _check_arguments(days, jobs, options)
    request = track_request(filter, kinds, hide, options)
    source, target = Path(folder), Path(out)
    check_apart(source, target)
    found = find_days(source)
    plan = _plan(source, Path(sensors), found, request, chained=days == CHAINED)
    slots = min(jobs or _cores(), len(found))
    with _held(target), closing(runner or _runner(request, slots)) as running:
        _check_settings(target, plan, again=again)
        _compile(request, plan)
        common = {"filter": filter, "kinds": kinds and sorted(kinds), "hide": hide and [*hide]}
        track_options = _plain({**options, **common}) | {
            "engine": "threads",
            "cluster_listen": None,
            "workers": _threads(slots),
        }
        starts = _Starts(target, plan, track_options, found, slots)
        outcomes: dict[str, Outcome] = {}

        def ended(outcome: Outcome) -> None:
            checked = _without_overlap(outcome, outcomes.values())
            outcomes[outcome.day.name] = checked
            on_end(checked)

        with job_bars("days", len(found)) as bars:
            schedule = Schedule(running, slots, start=starts.start, on_end=ended, bars=bars)
            schedule.run(_chains(found, days))
        in_order = [outcomes[day.name] for day in found]
        settings = {**plan.settings, "days": days}
        report = write_outputs(target, in_order, plan.regions, settings, merged=days == MERGED)
    findings = _findings(in_order)
    done = Reprocessed(target, report)
    if findings:
        raise FindingsError(findings, done)
    return done


@dataclass(frozen=True, slots=True)
class _Plan:
    # By region: its sensors, and the digest of what its output depends on.
    regions: dict[str, Region]
    digests: dict[str, str]
    settings: dict[str, Any]
    chained: bool


def _check_arguments(days: str, jobs: int | None, options: Mapping[str, object]) -> None:
    if days not in DAYS:
        raise ArgumentError(f"`days`: {unknown('choice', days, DAYS)}", "days")
    check_count("jobs", jobs)
    for name in _OF_ONE_RUN:
        if options.get(name) is not None:
            raise ArgumentError(f"`{name}` applies to one recording; use `track`", name)


def _plan(
    folder: Path, sensors: Path, days: Sequence[Day], request: TrackRequest, *, chained: bool
) -> _Plan:
    from multiradar.runtime.engine.fingerprint import configuration_fingerprint

    tracking = request.settings.tracking_settings()
    profile = request.path("profile")
    settings = _plain(
        {
            "version": version("multiradar"),
            **asdict(tracking),
            "kinds": None if request.kinds is None else sorted(request.kinds),
            "chained": chained,
            "profile": None if profile is None else _sha256(profile.read_text(encoding="utf-8")),
            **{
                name: value
                for name, value in request.options.items()
                if value and name not in ("config", "engine", "cluster_listen", "profile")
            },
        }
    )
    regions, digests = {}, {}
    for region in dict.fromkeys(day.region for day in days):
        own = folder / region / SENSORS_FILE
        file = own if region and own.is_file() else sensors
        regions[region] = Region(file, load_sensor_table(file))
        fingerprint = configuration_fingerprint(regions[region].table, tracking)
        digests[region] = _sha256({**settings, "fingerprint": fingerprint})
    return _Plan(regions, digests, settings, chained)


@contextmanager
def _held(out: Path) -> Iterator[None]:
    """Create the output directory, and keep other processes from using it."""
    if not out.exists():
        if not out.absolute().parent.is_dir():
            raise InputError(f"{out.absolute().parent}: no such folder; create it first")
        out.mkdir()
    if not out.is_dir() or (any(out.iterdir()) and not (out / RECORD_FILE).is_file()):
        raise OutputExistsError(
            f"{out}: already exists and is not the output of `reprocess`; choose another directory"
        )
    file = os.open(out, os.O_RDONLY)
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise OutputExistsError(f"{out}: another `reprocess` is writing to it") from error
        yield
    finally:
        os.close(file)


def _check_settings(out: Path, plan: _Plan, *, again: bool) -> None:
    before = read_json(out / RECORD_FILE) or {}
    now = {"settings": plan.settings, "digests": plan.digests}
    # Regions may be added.
    known: dict[str, str] = before.get("digests", {})
    differ = [name for name, digest in plan.digests.items() if known.get(name, digest) != digest]
    if differ and not again:
        old = before.get("settings", {})
        names = sorted({*old, *plan.settings})
        changed = [name for name in names if old.get(name) != plan.settings.get(name)]
        raise OutputExistsError(
            f"{out}: was created with different settings ({', '.join(changed) or 'sensors'}); "
            "choose another output directory, or use --again to reprocess its days"
        )
    write_json(out / RECORD_FILE, {**now, "digests": {**known, **plan.digests}})


def _compile(request: TrackRequest, plan: _Plan) -> None:
    from multiradar.runtime.kernel_purposes import track_purposes

    settings, outputs = request.settings.tracking_settings(), request.outputs()
    for region in plan.regions.values():
        compile_kernels(track_purposes(settings, region.table, outputs))


def _runner(request: TrackRequest, slots: int) -> "Jobs":
    from multiradar.cluster.jobs import JobProcesses
    from multiradar.cluster.ray_steps import with_ray

    if request.settings.engine == "ray":
        with with_ray():
            from multiradar.cluster.ray_jobs import RayJobs

        return RayJobs(run_day, request.settings.cluster, slots)
    threads = {"POLARS_MAX_THREADS": str(_threads(slots))}
    return JobProcesses(_WORKER, {} if "POLARS_MAX_THREADS" in os.environ else threads)


class _Starts:
    # Decides for each day whether it is complete.
    def __init__(
        self,
        out: Path,
        plan: _Plan,
        options: Mapping[str, Any],
        days: Sequence[Day],
        slots: int,
    ) -> None:
        self._out, self._plan, self._options = out, plan, options
        self._inputs = self._digests(days, slots)

    def start(self, day: Day, chain: Chain) -> Start:
        """Return the outcome of a complete day, else its job."""
        before = chain.before if self._plan.chained else None
        wanted = self._wanted(day, before)
        folder = self._out / day.name
        found = read_record(folder)
        inputs = self._inputs.get(day.name)
        if found is not None and inputs is not None:
            kept = {name: getattr(found, name) for name in wanted} == wanted
            if kept and found.input_sha256 == inputs:
                return Start({}, Outcome(day, KEPT, found))
        if day.region:
            (self._out / day.region).mkdir(exist_ok=True)
        options = dict(self._options)
        if before is not None:
            options["biases_from"] = str(self._out / before.day.name)
        same = {"options": options, "record": wanted}
        sensors = self._plan.regions[day.region].sensors
        return Start(day_job(day, sensors=sensors, out=folder, same=same))

    def _wanted(self, day: Day, before: Outcome | None) -> dict[str, str]:
        record = None if before is None else before.record
        return {
            "version": self._plan.settings["version"],
            "settings_sha256": self._plan.digests[day.region],
            "start": "" if before is None else before.day.date,
            "start_sha256": "" if record is None else record.output_sha256,
        }

    def _digests(self, days: Sequence[Day], slots: int) -> dict[str, str]:
        complete = [day for day in days if read_record(self._out / day.name) is not None]
        if not complete:
            return {}
        with (
            progress_bar("checking complete days", len(complete)) as show,
            ThreadPoolExecutor(slots) as pool,
        ):
            found = {}
            digests = pool.map(lambda day: input_sha256(day.path), complete)
            for done, (day, digest) in enumerate(zip(complete, digests, strict=True), 1):
                found[day.name] = digest
                show(done)
        return found


def _chains(days: Sequence[Day], how: str) -> list[Chain]:
    if how != CHAINED:
        return [Chain(deque([day])) for day in days]
    regions: dict[str, deque[Day]] = {}
    for day in days:
        regions.setdefault(day.region, deque()).append(day)
    return [Chain(one) for one in regions.values()]


def _without_overlap(outcome: Outcome, others: Collection[Outcome]) -> Outcome:
    # What is measured twice would count twice.
    own = outcome.record
    for other in others:
        record = other.record
        if own is None or record is None or other.day.region != outcome.day.region:
            continue
        common_s = min(own.last_s, record.last_s) - max(own.first_s, record.first_s)
        if common_s > OVERLAP_MAX_S:
            reason = f"its measurements overlap with {other.day.name} by {common_s:.0f} s"
            return Outcome(outcome.day, FAILED, reason=reason)
    return outcome


def _findings(outcomes: Sequence[Outcome]) -> list[str]:
    found = []
    for one in outcomes:
        if one.status == FAILED:
            found.append(f"{one.day.name}: {one.reason}")
        elif one.record is not None:
            found += [f"{one.day.name}: {sentence}" for sentence in one.record.findings]
    return found


def _cores() -> int:
    bound = getattr(os, "sched_getaffinity", None)
    return len(bound(0)) if bound is not None else os.cpu_count() or 1


def _threads(slots: int) -> int:
    return min(max(_cores() // slots, 1), _THREADS_MAX)


# As JSON, in which jobs travel and settings are compared.
def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    plain: dict[str, Any] = json.loads(json.dumps(values, default=str))
    return plain


def _sha256(document: object) -> str:
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
