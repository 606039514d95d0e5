"""Shards: one output wherever partitions are, move to and get lost; the states stay exact."""

from typing import Any

import numpy as np
import pytest

from multiradar.cluster import sharded_steps
from multiradar.cluster.hosts import LocalHost
from multiradar.cluster.shard import Answer, Batch, Shard, build
from multiradar.cluster.sharded_steps import FRONT, ShardedSteps
from multiradar.errors import ConfigurationError, PeerError
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.filters.imm._imm_step_kernels import imm_step
from multiradar.tracking.pool import CAPACITY_FIRST, PARTITIONS
from multiradar.tracking.settings import TrackingSettings
from support.cluster.shards import IDENTITY, Engines, FaultyHost, drifting_traffic, moved
from support.scenarios.scenes import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return drifting_traffic()


@pytest.fixture(scope="module")
def engines(scene: Scene) -> Engines:
    return Engines(scene, TrackingSettings(hidden_fields=IDENTITY))


@pytest.fixture(scope="module")
def expected(engines: Engines) -> str:
    return engines.on_threads()


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [(), IDENTITY], ids=["identity", "hidden"])
@pytest.mark.parametrize("name", ["two-stage", "imm", "blom", "blom-macro", "ci"])
def test_output_does_not_depend_on_shards_and_their_partitions(
    scene: Scene, name: str, hidden: tuple[str, ...]
) -> None:
    engines = Engines(scene, TrackingSettings(filter_name=name, hidden_fields=hidden))
    on_threads = engines.on_threads()
    assert engines.on_shards(LocalHost(), 1) == on_threads
    assert engines.document["rows_of_front"] == 0
    assert engines.on_shards(LocalHost(), 5, moved) == on_threads


def test_output_does_not_depend_on_lost_shards(engines: Engines, expected: str) -> None:
    """A shard is lost at every third batch, after it has changed its states."""
    host = FaultyHost(lose=range(0, 10_000, 3))
    assert engines.on_shards(host, 2, moved) == expected
    found = engines.document
    assert found["lost"] > 8
    assert found["restored"] >= found["lost"] - 1
    assert found["rows_of_front"] > 0
    assert len(set(host.names)) == len(host.names)


def test_an_answer_to_another_batch_is_not_used(engines: Engines, expected: str) -> None:
    assert engines.on_shards(FaultyHost(wrong=[5]), 2) == expected
    assert engines.document["lost"] == 1


def test_the_front_steps_the_partitions_of_a_shard_that_has_not_started(
    engines: Engines, expected: str
) -> None:
    host = FaultyHost(lose=[4], slow_starts=10)
    assert engines.on_shards(host, 1) == expected
    found = engines.document
    assert (found["lost"], found["restored"], found["partitions_of_front"]) == (1, 1, 0)
    assert found["rows_of_front"] > 0
    assert found["recovery_s"] >= 0.0


def test_shards_that_were_renewed_are_not_counted_as_restored(
    engines: Engines, expected: str, caplog: pytest.LogCaptureFixture
) -> None:
    """After a change of the sensors each of them was logged as restored after None s."""

    def renewed(epoch: int, steps: ShardedSteps) -> None:
        if epoch == 1:
            steps.renew(steps._pool, steps._spec.model)

    caplog.set_level("INFO")
    assert engines.on_shards(LocalHost(), 2, renewed) == expected
    found = engines.document
    assert (found["lost"], found["restored"], found["partitions_of_front"]) == (0, 0, 0)
    assert found["recovery_s"] is None
    assert "restored" not in caplog.text


def test_a_shard_that_cannot_start_is_started_again_after_a_pause(
    engines: Engines, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = FaultyHost(lose=[4], failing_starts=10_000)
    assert engines.on_shards(host, 1) == expected
    found = engines.document
    assert (found["shards_ready"], found["partitions_of_front"]) == (0, PARTITIONS)
    assert len(host.names) == 2  # Once: the pause is longer than this run.
    monkeypatch.setattr(sharded_steps, "RESTART_PAUSE_S", 0.0)
    host = FaultyHost(lose=[4], failing_starts=3)
    assert engines.on_shards(host, 1) == expected
    assert engines.document["partitions_of_front"] == 0


@pytest.mark.slow
def test_a_shard_has_the_states_of_more_aircraft_than_there_was_room_for(scene: Scene) -> None:
    """Clutter and aircraft fill the first slots of the pool, which then grows."""
    crowd = drifting_traffic(aircraft=CAPACITY_FIRST + 60, duration_s=12.0)
    engines = Engines(crowd, TrackingSettings())
    assert engines.on_shards(LocalHost(), 2, moved) == engines.on_threads()


def test_a_partition_has_one_owner(engines: Engines) -> None:
    seen = set()

    def look(epoch: int, steps: ShardedSteps) -> None:
        moved(epoch, steps)
        seen.update(steps.owner.tolist())

    engines.on_shards(FaultyHost(lose=[3], slow_starts=10_000), 2, look)
    assert seen == {FRONT, 0, 1}


def test_shards_end_with_the_engine(engines: Engines) -> None:
    host = FaultyHost()
    engines.on_shards(host, 2)
    assert (host.stopped, host.closed) == (["shard-0-1", "shard-1-1"], True)


def test_states_that_did_not_change_are_not_sent(engines: Engines) -> None:
    engines.on_shards(LocalHost(), 2)
    kept = engines.document["octets_sent"]
    engines.on_shards(LocalHost(), 2, moved)
    assert kept < engines.document["octets_sent"]


def test_a_filter_that_updates_all_aircraft_with_every_plot_is_rejected(scene: Scene) -> None:
    engines = Engines(scene, TrackingSettings(filter_name="joint"))
    with pytest.raises(ConfigurationError, match=r"engine: expected threads with the filter joint"):
        engines.on_shards(LocalHost(), 2)


@pytest.mark.parametrize("shards", [0, PARTITIONS + 1])
def test_the_number_of_shards_is_that_of_partitions_at_most(engines: Engines, shards: int) -> None:
    with pytest.raises(ConfigurationError, match=f"expected 1 to 16, was {shards}"):
        engines.on_shards(LocalHost(), shards)


def test_shards_that_do_not_start_are_an_error_and_leave_nothing(engines: Engines) -> None:
    host = FaultyHost(slow_first=1)
    with pytest.raises(PeerError, match=r"expected 2 shards within 300 s, but shard 0 has not"):
        engines.on_shards(host, 2)
    assert host.closed


def test_a_shard_of_another_version_does_not_start(
    engines: Engines, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sharded_steps, "build", lambda: "multiradar 0.0.1")
    with pytest.raises(ConfigurationError, match=r"expected multiradar 0\.0\.1 on every node"):
        engines.on_shards(LocalHost(), 2)
    assert build().startswith("multiradar ")


# Views: what the engine goes on with is the same memory, and stays as it is. Arrays that are common
# to all engines would stay read-only in this process, and kernels be compiled again for them.
def _read_only(received: Any) -> Any:
    if isinstance(received, tuple):
        return type(received)._make(map(_read_only, received))  # type: ignore[attr-defined]
    if isinstance(received, np.ndarray):
        received = received.view()
        received.flags.writeable = False
    return received


def test_what_was_received_without_a_copy_is_stepped(scene: Scene) -> None:
    """Arrays in shared memory cannot be written; kernels are compiled for arrays that can."""

    class ReadOnly(Shard):
        def step(self, batch: Batch, model: Model | None) -> Answer:
            return super().step(_read_only(batch), _read_only(model))

    engines = Engines(scene, TrackingSettings(filter_name="imm"))
    kernel: Any = imm_step
    expected, compiled = engines.on_threads(), list(kernel.signatures)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("multiradar.cluster.hosts.Shard", ReadOnly)
        assert engines.on_shards(LocalHost(), 2) == expected
    assert kernel.signatures == compiled
