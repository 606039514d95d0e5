"""The engine `ray`: absent, or without the addresses on which it may listen."""

import builtins
import sys
from pathlib import Path
from typing import Any

import pytest

from multiradar.cluster.ray_steps import steps_of
from multiradar.errors import ConfigurationError
from multiradar.settings.cluster import ClusterSettings
from multiradar.settings.service import Settings, load_settings
from multiradar.toolbox.tracking.track import track
from support.processes.served import SENSORS


class AnyRay:
    """In place of the module, so that these tests do not need it."""


def without_ray(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the import of Ray fail as if it were not installed."""
    real = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.partition(".")[0] == "ray":
            raise ModuleNotFoundError("No module named 'ray'", name="ray")
        return real(name, *rest, **more)

    monkeypatch.delitem(sys.modules, "multiradar.cluster.ray_host", raising=False)
    monkeypatch.setattr(builtins, "__import__", without)


def ray_settings(*listen: str) -> Settings:
    return load_settings(None, {"engine": "ray", "cluster": {"listen": listen}})


def test_threads_are_the_default() -> None:
    assert Settings().engine == "threads"
    assert steps_of(Settings(), 2) is None


def test_an_absent_engine_names_what_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    without_ray(monkeypatch)
    with pytest.raises(ConfigurationError, match=r"pip install .* -r requirements/cluster\.txt"):
        steps_of(ray_settings("127.0.0.1"), 2)


def test_addresses_must_be_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "multiradar.cluster.ray_host", _host_module())
    with pytest.raises(ConfigurationError, match=r"cluster\.listen: missing.*network namespace"):
        steps_of(ray_settings(), 2)


def test_every_interface_must_be_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loopback is named; a host of its own has further interfaces."""
    monkeypatch.setitem(sys.modules, "multiradar.cluster.ray_host", _host_module())
    others = {"lo": {"127.0.0.1"}, "eth0": {"192.0.2.7"}}
    monkeypatch.setattr("multiradar.cluster.ray_steps.addresses_of_host", lambda: others)
    with pytest.raises(ConfigurationError, match=r"interface eth0 \(192\.0\.2\.7\) is listed"):
        steps_of(ray_settings("127.0.0.1"), 2)
    steps = steps_of(ray_settings("192.0.2.7"), 2)
    assert steps is not None
    # Nothing has started.
    assert steps.document() == {}


def test_track_reports_it_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "multiradar.cluster.ray_host", _host_module())
    (tmp_path / "sensors.toml").write_text(SENSORS, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"cluster\.listen: missing"):
        track(tmp_path, tmp_path / "sensors.toml", out=tmp_path / "out", engine="ray")
    assert not (tmp_path / "out").exists()


def test_an_unknown_engine(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="engine: unknown name 'dask'"):
        track(tmp_path, tmp_path / "sensors.toml", engine="dask")


@pytest.mark.parametrize("head", ["10.0.0.5", "10.0.0.5:x", "a b:1", "http://10.0.0.5:6379"])
def test_a_cluster_has_a_host_and_a_port(head: str) -> None:
    with pytest.raises(ConfigurationError, match=r"cluster\.head"):
        load_settings(None, {"cluster": {"head": head}})


def test_addresses_are_ipv4() -> None:
    assert ClusterSettings(listen=("10.0.0.5",)).listen == ("10.0.0.5",)
    with pytest.raises(ConfigurationError, match=r"cluster\.listen.*IPv4 address"):
        load_settings(None, {"cluster": {"listen": ["localhost"]}})


def _host_module() -> Any:
    import types

    module = types.ModuleType("multiradar.cluster.ray_host")
    module.RayHost = AnyRay  # type: ignore[attr-defined]
    return module
