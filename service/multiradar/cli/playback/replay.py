"""`multiradar replay`: replay of a recording to a running service, in data time."""

import math
import sys
import time
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.options import (
    TRACKING_DEFAULTS,
    AllowMissingOption,
    DateOption,
    JsonOption,
    KindsOption,
    MeasurementsArgument,
    ProfileOption,
    chosen_kinds,
)
from multiradar.cli.playback.datagrams import Times, is_udp, replay_datagrams
from multiradar.errors import DataWarning, FindingsError, InputError
from multiradar.toolbox.conversion.measurements import dump_diagnoses, open_measurements
from multiradar.toolbox.diagnoses import findings_of
from multiradar.toolbox.inputs import DumpChoice, check_found, counts_by_code
from multiradar.toolbox.messages.progress import progress_bar
from multiradar.toolbox.messages.warning import warn

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from multiradar.ingest.replay.replaying import Destination, ReplayCounts

_BATCH_ROWS, _BATCH_ROWS_MAX = 1000, 65_536
_AWAY_MAX_S = 120.0
_HERE = "127.0.0.1"


class EncodingChoice(StrEnum):
    """Encoding of a batch."""

    ARROW = "arrow"
    JSON = "json"
    NDJSON = "ndjson"


def parse_speed(text: str) -> float:
    """Return the playback speed; `max` is infinite."""
    if text == "max":
        return math.inf
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0.0 < speed < math.inf:
        msg = f"expected a number above 0, or max, was {text!r}"
        raise typer.BadParameter(msg)
    return speed


def replay(
    measurements: MeasurementsArgument,
    *,
    to: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS",
            help="Service address: http://127.0.0.1:8321 or zenoh:tcp/127.0.0.1:7447; for an "
            "ASTERIX recording udp:ADDRESS:PORT, unicast or a multicast group. For a "
            "primary and its standby: both addresses, separated by a comma.",
        ),
    ] = "http://127.0.0.1:8321",
    speed: Annotated[
        float,
        typer.Option(
            metavar="NUMBER|max",
            parser=parse_speed,
            help="Playback speed (1 = real time); max: as fast as the service ingests.",
        ),
    ] = "1.0",  # type: ignore[assignment]  # given to the parser like any other text
    batch: Annotated[
        int,
        typer.Option(
            min=1, max=_BATCH_ROWS_MAX, help="Maximum number of measurements per message."
        ),
    ] = _BATCH_ROWS,
    encoding: Annotated[
        EncodingChoice, typer.Option(help="Message encoding.")
    ] = EncodingChoice.ARROW,
    kinds: KindsOption = None,
    date: DateOption = None,
    profile: ProfileOption = None,
    allow_missing: AllowMissingOption = False,
    flush: Annotated[
        bool,
        typer.Option(
            help="Mark the end of the stream after the recording, so that buffered measurements "
            "are processed."
        ),
    ] = True,
    run_name: Annotated[
        str | None,
        typer.Option(
            help="Name of this run; under a different name, the same measurements are ingested "
            "again.",
            show_default="derived from the content",
        ),
    ] = None,
    wait: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            max=86_400.0,
            help="Time for which to retry after the connection to the service is lost, s. If the "
            "service has not responded yet, the limit is 5 s; while the service is starting, "
            "there is no limit.",
        ),
    ] = _AWAY_MAX_S,
    interface: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS", help="With udp: network interface for the multicast group."
        ),
    ] = _HERE,
    times: Annotated[
        Times,
        typer.Option(help="With udp: times of day as recorded, or shifted to the present."),
    ] = Times.RECORDED,
    json_wanted: JsonOption = False,
) -> None:
    """Replay a recording to a service; already acknowledged data are not ingested again.

    With udp: MEASUREMENTS is an ASTERIX recording, sent datagram by datagram as recorded.
    """
    if is_udp(to):
        _require_none(
            "do not apply with --to udp:",
            {
                "--kinds": kinds is not None,
                "--date": date is not None,
                "--profile": profile is not None,
                "--run-name": run_name is not None,
                "--batch": batch != _BATCH_ROWS,
                "--encoding": encoding is not EncodingChoice.ARROW,
                "--wait": wait != _AWAY_MAX_S,
                "--no-flush": not flush,
                "--allow-missing": allow_missing,
            },
        )
        replay_datagrams(
            measurements,
            to,
            interface=interface,
            speed=speed,
            times=times,
            json_wanted=json_wanted,
        )
        return
    _require_none(
        "apply with --to udp: only",
        {"--interface": interface != _HERE, "--times": times is not Times.RECORDED},
    )
    from multiradar.clock import SystemClock
    from multiradar.ingest.replay.replaying import Replay, ReplayPlan
    from multiradar.ingest.replay.service_diagnoses import service_diagnoses

    plan = ReplayPlan(
        batch_rows=batch,
        speed=speed,
        kinds=chosen_kinds(kinds),
        run_name=_checked_run_name(run_name),
        flush=flush,
        away_max_s=wait,
    )
    dump = DumpChoice(date, profile, allow_missing)
    # The reordering horizon of a service with default settings.
    opened = open_measurements(measurements, dump, TRACKING_DEFAULTS.reorder_horizon_s)
    with opened as recording:
        destination = _destination(to, encoding)
        try:
            with progress_bar("replaying", recording.rows) as show:
                play = Replay(
                    recording,
                    destination,
                    plan,
                    SystemClock(),
                    time.sleep,
                    lambda counts: show(counts.read),
                    _print_wait,
                )
                counts = play.run()
            configured = destination.configured() if counts.unknown_sensors else ()
            found = service_diagnoses(destination, play.sensor_ids, time.sleep) if flush else []
        finally:
            destination.close()
        check_found(counts.read, plan.kinds, measurements)
        findings = findings_of([*dump_diagnoses(recording, plan.kinds), *found])
        _add_lines(counts, recording.rejected_by_code(plan.kinds))
    _print_counts(counts, json_wanted)
    if counts.unknown_sensors:
        raise InputError(_unknown_sensors(counts.unknown_sensors, configured))
    late = counts.rejected_by_code.get("TIME_LATE", 0)
    if late > _LATE_MAX * counts.read:
        warn(
            f"{late} of {counts.read} measurements were rejected as TIME_LATE: the data time of "
            "the service is later than their times; if this recording was replayed before with "
            "another --batch, --speed or --kinds, the service already has these measurements",
            DataWarning,
        )
    if counts.rejected == counts.read:
        codes = counts_by_code(counts.rejected_by_code)
        msg = f"none of {counts.read} measurements were accepted: {codes}{_first(play.reasons)}"
        if not findings:
            raise InputError(msg)
        findings.append(msg)
    if findings:
        raise FindingsError(findings, counts)


def _require_none(why: str, given: "Mapping[str, bool]") -> None:
    names = [name for name, is_given in given.items() if is_given]
    if names:
        raise typer.BadParameter(f"{' and '.join(names)} {why}")


# Why the first of them was rejected, if all were for one reason.
def _first(reasons: "Mapping[str, str]") -> str:
    return f"; the first: {next(iter(reasons.values()))}" if len(reasons) == 1 else ""


# Lines of a dump that were never sent.
def _add_lines(counts: "ReplayCounts", rejected: "Mapping[str, int]") -> None:
    counts.read += sum(rejected.values())
    counts.rejected += sum(rejected.values())
    for code, count in rejected.items():
        counts.rejected_by_code[code] = counts.rejected_by_code.get(code, 0) + count


#: A fraction of late measurements above this has a cause other than the network.
_LATE_MAX = 0.05


def _unknown_sensors(unknown: "Mapping[str, int]", configured: "Sequence[str]") -> str:
    # Imported here: help must be fast.
    from multiradar.diagnosis.names import counted, listed
    from multiradar_schemas.documents.names import nearest

    names = listed(
        [
            f"{name} ({counted(count)}{'; did you mean ' + near + '?' if near else ''})"
            for name, count in sorted(unknown.items())
            for near in [nearest(name, configured)]
        ]
    )
    has = f", which has {listed(configured)}" if configured else ""
    return (
        f"the recording contains sensors that are not configured in the service{has}: {names}; "
        "their measurements were rejected; start the service with the sensors file of the recording"
    )


def _print_wait(sentence: str) -> None:
    print(f"multiradar: {sentence}", file=sys.stderr, flush=True)


def _checked_run_name(name: str | None) -> str | None:
    # It becomes the first part of every idempotency key, which is printable ASCII.
    if name is None or (name.isascii() and name.isprintable() and 0 < len(name.strip()) <= 64):
        return None if name is None else name.strip()
    msg = "expected a run name of 1 to 64 printable ASCII characters"
    raise typer.BadParameter(msg)


def _destination(to: str, encoding: EncodingChoice) -> "Destination":
    addresses = [one.strip() for one in to.split(",")]
    if len(addresses) == 1:
        return _one_destination(to, encoding)
    from multiradar.ingest.replay.alternatives import Alternatives

    return Alternatives([_one_destination(one, encoding) for one in addresses])


def _one_destination(to: str, encoding: EncodingChoice) -> "Destination":
    if to.startswith(("http://", "https://")):
        from urllib.parse import urlsplit

        from multiradar.ingest.replay.http import Encoding, HttpDestination

        try:
            named = bool(urlsplit(to).hostname) and urlsplit(to).port != 0
        except ValueError:
            named = False
        if not named:
            msg = f"--to: expected an address such as http://127.0.0.1:8321, was {to!r}"
            raise typer.BadParameter(msg)
        return HttpDestination(to, Encoding(encoding.value))
    if to.startswith("zenoh:"):
        from multiradar.ingest.replay.http import Encoding
        from multiradar.ingest.replay.zenoh import ZenohDestination

        return ZenohDestination(to.removeprefix("zenoh:"), Encoding(encoding.value))
    msg = f"--to: expected http://ADDRESS, zenoh:ENDPOINT or udp:ADDRESS:PORT, was {to!r}"
    raise typer.BadParameter(msg)


def _print_counts(counts: "ReplayCounts", json_wanted: bool) -> None:
    if json_wanted:
        import json
        from dataclasses import asdict

        print(json.dumps(asdict(counts)))
        return
    print(
        f"{counts.read} measurements in {counts.batches} messages: {counts.accepted} accepted, "
        f"{counts.rejected} rejected, {counts.duplicate} duplicate"
        + (f"; {counts.retries} retries" if counts.retries else "")
    )
    if counts.rejected_by_code:
        print(f"rejected: {counts_by_code(counts.rejected_by_code)}")
