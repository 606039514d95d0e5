"""Shards on Ray: one output with any number of them, and when they die, hang, move or leave.

Ray is started in a network namespace with the loopback interface only, once for all tests.
"""

import fcntl
import importlib.util
import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

from support.paths import ROOT, TESTS
from support.processes.waiting import run_to_end
from support.required import skip_unless_required
from validation.service.namespace import in_namespace, why_no_namespace
from validation.tracker.archive_days import date_of, write_days

Found = dict[str, Any]


def why_not() -> str:
    """Return why these tests cannot run here, empty if they can."""
    if importlib.util.find_spec("ray") is None:
        return "Ray is not installed (requirements/cluster.txt)"
    reason = why_no_namespace()
    return f"no network namespace: {reason}" if reason else ""


@pytest.fixture(name="cluster", scope="session")
def _cluster() -> None:
    reason = why_not()
    if reason:
        skip_unless_required("cluster", reason)


@pytest.fixture(scope="session")
def played(tmp_path_factory: pytest.TempPathFactory, cluster: None) -> Found:
    """Play the scenes: the first process of the tests does, others wait for it."""
    base = tmp_path_factory.getbasetemp()
    place = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    with (place / "cluster.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = place / "cluster.json"
        if not found.exists():
            play(found)
        return dict(json.loads(found.read_text(encoding="utf-8")))


def play(out: Path) -> None:
    line = in_namespace([sys.executable, "-m", "support.cluster.ray_scenes", str(out)])
    paths = {"PYTHONPATH": os.pathsep.join((str(TESTS), str(ROOT)))}
    done = run_to_end(line, env=os.environ | paths)
    assert done.returncode == 0, done.stderr[-4000:]


@pytest.fixture
def expected(played: Found) -> str:
    return str(played["threads"]["imm"])


def test_output_does_not_depend_on_the_number_of_actors(played: Found, expected: str) -> None:
    """With partitions that move at each epoch."""
    for shards in (1, 2, 5):
        found = played["shards"][f"imm-{shards}"]
        assert (found["digest"], found["lost"]) == (expected, 0)
        assert found["rows_of_front"] == 0
    assert played["shards"]["two-stage-2"]["digest"] == played["threads"]["two-stage"]


@pytest.mark.fault(28)
def test_output_does_not_depend_on_actors_that_are_killed(played: Found, expected: str) -> None:
    """One in each epoch, with kill -9."""
    found = played["kills"]
    assert found["digest"] == expected
    assert found["lost"] >= 4
    assert found["recovery_s"] > 0.0


@pytest.mark.fault(28)
def test_an_actor_that_hangs_is_replaced(played: Found, expected: str) -> None:
    found = played["hangs"]
    assert (found["digest"], found["lost"]) == (expected, 1)


def test_an_actor_dies_with_a_batch(played: Found, expected: str) -> None:
    found = played["dies_with_a_batch"]
    assert (found["digest"], found["lost"]) == (expected, 1)
    assert found["rows_of_front"] > 0


def test_a_node_leaves(played: Found, expected: str) -> None:
    found = played["node_leaves"]
    assert found["digest"] == expected
    assert found["lost"] >= 1


def test_a_second_front_is_rejected(played: Found) -> None:
    found = played["second_front"]
    assert found["rejected"].startswith("cluster: another front of this cluster is running at")
    assert f"127.0.0.1, process {found['process']}" in found["rejected"]


def test_no_cluster_at_the_address(played: Found) -> None:
    assert played["nothing_there"]["error"].startswith("cluster: cannot use Ray at 127.0.0.1:9: ")


@pytest.mark.usefixtures("cluster")
def test_days_that_are_tasks_of_ray_have_the_same_bytes(tmp_path: Path) -> None:
    days = tmp_path / "days"
    sensors = write_days(days, [0.0, 0.0])
    # Of this folder, which the tasks do not share.
    line = ["reprocess", days.name, "--sensors", sensors, "--out"]
    outputs = []
    for more in (["processes"], ["tasks", "--engine", "ray", "--cluster-listen", "127.0.0.1"]):
        command = [sys.executable, "-m", "multiradar", *map(str, line), *more]
        done = run_to_end(in_namespace(command), env=os.environ, cwd=tmp_path)
        assert done.returncode == 0, done.stderr[-4000:]
        outputs.append(
            [(tmp_path / more[0] / date_of(day) / "tracks.parquet").read_bytes() for day in (0, 1)]
        )
    assert outputs[0] == outputs[1]
