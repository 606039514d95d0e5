"""Every attribute of what has state is in a snapshot, or known to be given or computed again."""

from pathlib import Path
from typing import Any, get_origin

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.service import Service
from multiradar.runtime.memory.regions.areas import Areas, Centre
from multiradar.runtime.memory.regions.board import RegionBoard, RegionRules
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from support.processes.live_services import TABLE

#: Attributes that are not in a snapshot: constants from the parameters, what is filled before it is
#: read, rows that have files of their own, connections with others.
OTHER = {
    "AircraftPool": "_definition _sizes _capacity_max _compared",
    "Association": "_sensors _associates _shares _patience _shadow_hits _sharing _periods _apart "
    "_rules _speed_variance _grid _scores",
    "BearingStarts": "_sensors _speeds_mps _active",
    "BiasBoard": "_sensor ring",
    "BiasEstimator": "_sensors _definition _starts",
    "BiasTrends": "_sensors",
    "BlockDigest": "_parts _digest _room",
    "ClutterMap": "_periods_s _usual log_usual",
    "DelayLog": "",
    "Engine": "_settings _sensors _sources _filter _plane _shared _sampling _pictures _stepper",
    "ForecastCalibration": "family",
    "ForecastScores": "_first_motion _first",
    "JumpTests": "_radars _periods _tests",
    "Knowledge": "sensors tracking limits trajectories silence regions _lock _states _frame "
    "_frame_version _version",
    "HealthBoard": "_epochs",
    "LiveTracks": "sources",
    "NearDuplicates": "_spans_s _identity",
    "Origins": "",
    "OutputDigest": "",
    "OutputEvents": "sensors _limits _period_s ring delay_s _kinds _ends _marks _changes _region "
    "_region_marks",
    "PastRows": "samples _biases _healths",
    "Plausibility": "active",
    "Processor": "_snapshots _clock _on_failure _journal _backlog _open_engine _first_sensors "
    "sensors _publication _rows_max _lock _futures _states _figures _engine "
    "_is_used _is_whole processed skipped oldest_s moved_s failure following",
    "Publication": "diagnosis _readers _recorder _regions _silence repeating traces view",
    "RegionBoard": "areas rules _lock",
    "RejectBoard": "sensors _kept_max _lock",
    "ReorderBuffer": "_horizon_s arrivals dropped",
    "SensorBoard": "_sensors",
    "SensorHealth": "_sensors _settings _radars _periods _sites _noises _bounds_bias_errors",
    "SetBacks": "",
    "SharedBiases": "_sensors _filter _epoch_s",
    "SiteUse": "_sites",
    "TrackHistory": "_rows _appended _claimed _time_s _previous _newest",
    "TrackTally": "",
    "TransitionLog": "_coast_after_s",
}


def test_every_attribute_is_in_a_snapshot_or_known_not_to_be_state(tmp_path: Path) -> None:
    tracking = TrackingSettings()
    service = Service(
        open_journal=MemoryJournal,
        open_engine=lambda: Engine(TABLE, tracking, sampling=Sampling.ALL),
        sensors=TABLE,
        tracking=tracking,
    )
    board = RegionBoard(Areas(Centre("a", 50.0, 14.0), [Centre("b", 50.0, 18.0)]), RegionRules())
    service.publication.divide(board)
    service.start()
    found: dict[str, str] = {}
    processor: Any = service._processor
    for holder in (processor._engine, processor, service.publication, board):
        _gather(holder, found)
    service.stop()
    # A new attribute belongs into `STATE` of its class unless it is of one of the other kinds.
    assert found == {name: " ".join(sorted(words.split())) for name, words in OTHER.items()}


def _gather(holder: Any, found: dict[str, str]) -> None:
    kind = type(holder)
    found[kind.__name__] = " ".join(sorted(vars(holder).keys() - kind.STATE.keys()))
    for name, declared in kind.STATE.items():
        if hasattr(get_origin(declared) or declared, "STATE"):
            _gather(getattr(holder, name), found)
