"""Checks of an installation as a whole; nothing is changed."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.clock import Clock, SystemClock
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.toolbox.operation import history_health, installation, state_health
from multiradar.toolbox.operation.backups import configuration_difference, journal_of
from multiradar.toolbox.operation.findings import Finding, Level, error, found, ok, warning

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.settings.service import Settings
    from multiradar.storage.verification import Progress

_CORRECT = "correct the error and run doctor again"
_OPTIONS = "run doctor with the options of the service (--sensors, --config, --filter)"


def examine(
    *, state: Path | None = None, config: Path | None = None, sensors: Path | None = None,
    filter_name: str | None = None, archive: Path | None = None, clock: Clock | None = None,
    on_progress: "Progress" = lambda _done, _total: None,
) -> list[Finding]:  # fmt: skip
    """Check an installation, as the user and with the options that the service has.

    Parameters
    ----------
    state : Path, optional
        Folder of the state, or the journal in it; that of the settings by default.
    config, sensors : Path, optional
        The settings file and the sensors file of the service.
    filter_name : str, optional
        The filter of the service, if it differs from that of the settings.
    archive : Path, optional
        The archive of the journal.
    clock : Clock, optional
        The clock that is checked; that of the system by default.
    on_progress : callable
        Called with the number of verified entries and that of all.

    Returns
    -------
    list of Finding
        One for each check. Those that depend on a file that cannot be read are missing.
    """
    overrides: dict[str, Any] = {} if sensors is None else {"sensors": sensors}
    if state is not None:
        overrides["journal"] = {"path": journal_of(state)}
    if filter_name is not None:
        overrides["tracking"] = {"filter_name": filter_name}
    findings = [
        found("python", "", installation.check_python),
        found("packages", "", installation.check_packages),
    ]
    settings = _read_settings(config, overrides, findings)
    if settings is None:
        return findings
    table = _read_sensors(settings, findings)
    if table is not None:
        known = table
        findings.append(
            found("kernels", _CORRECT, lambda: installation.check_kernels(settings, known))
        )
    journal, clock = settings.journal.path, clock or SystemClock()
    user = state_health.using_process(journal)
    findings.append(found("open files", "", lambda: installation.check_open_files(settings)))
    findings.append(found("ports", "", lambda: installation.check_ports(settings, user)))
    overlays = settings.page.overlays
    findings.append(found("folders", "", lambda: state_health.check_folders(journal, overlays)))
    limits = settings.runtime_limits()
    growth = state_health.recent(journal)
    findings.append(found("disk", "", lambda: state_health.check_disk(journal, limits, growth)))
    ahead_max_s = limits.clock_ahead_max_s
    findings.append(state_health.check_clock(clock, ahead_max_s, growth, running=user is not None))
    findings += _check_state(settings, table, archive, on_progress)
    return findings


def _read_settings(
    config: Path | None, overrides: dict[str, Any], findings: list[Finding]
) -> "Settings | None":
    from multiradar.access.authentication import Authentication, with_default_file
    from multiradar.access.exposure import open_addresses_of
    from multiradar.settings.service import load_settings

    read: list[Settings] = []

    def look() -> Finding:
        settings = load_settings(config, overrides)
        tracking = settings.tracking_settings()
        read.append(settings)
        authentication = Authentication(with_default_file(settings.access))
        reachable = "; ".join(open_addresses_of(settings, authentication.required))
        if reachable:
            level = warning if settings.access.insecure else error
            return level("settings", reachable, "see docs/howto/security.md")
        return ok("settings", f"{config or 'defaults'}, filter {tracking.filter_name}")

    findings.append(found("settings", _CORRECT, look))
    return read[0] if read else None


def _read_sensors(settings: "Settings", findings: list[Finding]) -> "SensorTable | None":
    read: list[SensorTable] = []

    def look() -> Finding:
        table = load_sensor_table(settings.sensors)
        read.append(table)
        return ok("sensors", f"{settings.sensors}: {len(table.ids)} sensors")

    findings.append(found("sensors", _CORRECT, look))
    return read[0] if read else None


# As the service decides it at its start.
def _why_no_snapshots(settings: "Settings") -> list[str]:
    from multiradar.runtime.live.snapshots import why_none

    if not settings.journal.snapshot_interval_s:
        return ["journal.snapshot_interval_s is 0"]
    used = {
        "trajectories.aircraft_max": settings.trajectories.aircraft_max,
        "asterix.output": settings.asterix.output,
    }
    return why_none(settings.runtime_limits(), [name for name, given in used.items() if given])


def _check_state(
    settings: "Settings", table: "SensorTable | None", archive: Path | None,
    on_progress: "Progress",
) -> list[Finding]:  # fmt: skip
    journal = settings.journal.path
    verification, findings = state_health.verified(
        journal, on_progress, no_snapshots=_why_no_snapshots(settings)
    )
    if verification is not None and table is not None and findings[0].level is Level.OK:
        sound = findings[0]

        def look() -> Finding:
            other = configuration_difference(journal, settings)
            return error("journal", other, _OPTIONS) if other else sound

        findings[0] = found("journal", _OPTIONS, look)
    past = settings.history.folder
    if past is not None:
        limits = settings.runtime_limits()
        findings.append(
            found("history", "choose another folder for the history",
                  lambda: history_health.check_history(past, journal, limits))
        )  # fmt: skip
    folder = archive or settings.retention.archive
    whole = verification is None or verification.first == 1
    if folder is not None and archive is None and whole and not folder.exists():
        advice = f"run `multiradar archive {journal.parent} {folder}`, and repeat this daily"
        findings.append(warning("archive", f"{folder}: not created yet", advice))
    elif folder is not None:
        chosen = folder
        entries = 0 if verification is None else verification.entries
        findings.append(
            found("archive", "run doctor with the output folder of `multiradar archive`",
                  lambda: state_health.check_archive(chosen, journal, entries, on_progress))
        )  # fmt: skip
    return findings
