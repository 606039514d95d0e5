"""A history on disk for a running service: written from its memory, read by its queries."""

import json
from dataclasses import asdict

from multiradar.clock import SystemClock
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.threads import SystemThreads
from multiradar.runtime.offline.offline_report import REPORT_FILE
from multiradar.runtime.recorded.history_reader import HistoryReader
from multiradar.runtime.recorded.history_writer import HistoryRules, HistoryWriter
from multiradar.simulation.scenario.toml_text import toml_text
from multiradar.tracking.settings import TrackingSettings

#: The sensors of an hour, where `view` looks for them.
SENSORS_FILE = "sensors.toml"


def keep_history(service: Service, rules: HistoryRules, tracking: TrackingSettings) -> None:
    """Let a service, which was not started, write a history and answer from it.

    Parameters
    ----------
    service : Service
        The service.
    rules : HistoryRules
        Where the history is, and what is kept.
    tracking : TrackingSettings
        Its settings, of which each hour has a copy.
    """
    known = service.publication.known

    def beside() -> dict[str, bytes]:
        found = {REPORT_FILE: json.dumps({"settings": asdict(tracking)}).encode()}
        sensors = [service.describe_sensor(one) for one in known.sensors.ids]
        described = [one for one in sensors if one is not None]
        if described:
            found[SENSORS_FILE] = toml_text({"sensor": described}).encode()
        return found

    writer = HistoryWriter(rules, known, beside, SystemClock(), SystemThreads())
    reader = HistoryReader(rules.folder, known, writer.oldest_s, writer.written_s, writer.steps)
    service.publication.keep_history(writer, reader)
