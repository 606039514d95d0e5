"""The whole application on Zenoh: it announces its actual address, not the configured one."""

from pathlib import Path

from multiradar.app import Application
from multiradar.settings.service import load_settings
from support.scenarios import live_scene
from support.scenarios.zenoh_scene import free_endpoint


def test_the_endpoints_announced_are_those_of_the_configuration_file(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    file = tmp_path / "zenoh.json5"
    file.write_text(f"""{{
        mode: "peer",
        listen: {{ endpoints: ["{endpoint}"] }},
        scouting: {{ multicast: {{ enabled: false }} }},
    }}""")
    settings = {
        "server": {"port": 0},
        "journal": {"path": tmp_path / "journal.sqlite"},
        "zenoh": {"config_file": file},
    }
    application = Application(load_settings(None, settings), live_scene.sensors(), lambda: None)
    assert list(application.zenoh_endpoints) == []
    application.start()
    try:
        assert list(application.zenoh_endpoints) == [endpoint]
    finally:
        application.stop()
    assert list(application.zenoh_endpoints) == []
