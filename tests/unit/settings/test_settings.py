"""Settings: precedence of sources, and messages for wrong keys and values."""

from pathlib import Path

import pytest

from multiradar.errors import ConfigurationError
from multiradar.settings.service import Settings, load_settings
from multiradar.settings.variables import KEY_VARIABLE, TRACEBACK_VARIABLE
from multiradar.tracking.settings import TrackingSettings


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "multiradar.toml"


def test_defaults_are_loopback_without_multicast() -> None:
    settings = load_settings()
    assert (settings.server.host, settings.server.port) == ("127.0.0.1", 8321)
    assert settings.zenoh.listen == ("tcp/127.0.0.1:7447",)
    assert not settings.zenoh.multicast
    assert settings.tracking_settings() == TrackingSettings()


def test_explicit_wins_over_environment_over_file(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file.write_text("[tracking]\nepoch_s = 2\ncoast_after_s = 20\nrefusals_max = 5\n")
    monkeypatch.setenv("MULTIRADAR_TRACKING__EPOCH_S", "3.5")
    monkeypatch.setenv("MULTIRADAR_TRACKING__COAST_AFTER_S", "30")
    settings = load_settings(file, {"tracking": {"epoch_s": 8.0}}).tracking_settings()
    assert (settings.epoch_s, settings.coast_after_s, settings.refusals_max) == (8.0, 30.0, 5)
    assert settings.drop_after_s == TrackingSettings().drop_after_s


def test_a_setting_that_the_filter_does_not_use_is_an_error(file: Path) -> None:
    file.write_text("[tracking]\nacceleration_density = 0.02\n")
    with pytest.raises(ConfigurationError, match="acceleration_density: not used by the"):
        load_settings(file).tracking_settings()
    with pytest.raises(ConfigurationError, match="acceleration_density and motion: not used"):
        load_settings(file, {"tracking": {"motion": "velocity-frame"}}).tracking_settings()
    chosen = load_settings(file, {"tracking": {"filter_name": "two-stage"}}).tracking_settings()
    assert chosen.acceleration_density == 0.02


def test_lists_come_as_json_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MULTIRADAR_ZENOH__LISTEN", '["tcp/127.0.0.1:0"]')
    assert load_settings().zenoh.listen == ("tcp/127.0.0.1:0",)
    monkeypatch.setenv("MULTIRADAR_ZENOH__LISTEN", "tcp/127.0.0.1:0")
    with pytest.raises(ConfigurationError, match="expected JSON for a list"):
        load_settings()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "[tracking]\nepoch = 3",
            "line 2: tracking: unknown setting 'epoch' (did you mean 'epoch_s'?); known: filter_na",
        ),
        ("[tracking]\nepoch_s = true", "tracking.epoch_s: expected a number, was true"),
        (
            "[tracking]\nepoch_s = 0",
            "line 2: tracking.epoch_s: expected a number from 0.001 to 3600, was 0",
        ),
        ("[tracking]\nepoch_s = nan", "tracking.epoch_s: expected a finite number, was nan"),
        ("[tracking]\nepoch_s = 'x'", "tracking.epoch_s: expected a number, was 'x'"),
        (
            "[server]\nport = 65536",
            "line 2: server.port: expected a number from 0 to 65535, was 65536",
        ),
        (
            "[http]\nbody_bytes_max = 0",
            "http.body_bytes_max: expected a number of at least 1, was 0",
        ),
        ("[zenoh]\nmode = 'star'", "zenoh.mode: unknown name 'star'; known: peer, client, router"),
        ("[zenoh]\nlisten = ['here']", "zenoh.listen[0]: expected text of the form"),
        (
            "[trajectories]\naircraft_max = -1",
            "line 2: trajectories.aircraft_max: expected a number from 0 to 10000, was -1",
        ),
        ("[trajectories]\naircraft_max = 10001", "expected a number from 0 to 10000, was 10001"),
        ("[trajectories]\nplots_waiting_max = 0", "trajectories.plots_waiting_max: expected a"),
        (
            "[trajectories]\nworkers = 17",
            "line 2: trajectories.workers: expected a number from 1 to 16, was 17",
        ),
        ("[trajectories]\nlateral_max_mps2 = nan", "lateral_max_mps2: expected a"),
        ("[radar]\nx = 1", "line 1: unknown setting 'radar'; known: sensors, workers"),
        ("server = 3", "line 1: server: expected a table, was 3"),
        ("[", "not valid TOML: "),
    ],
)
@pytest.mark.fault(30)
def test_a_wrong_key_or_value_is_reported_in_one_sentence(
    text: str, sentence: str, file: Path
) -> None:
    file.write_text(text)
    with pytest.raises(ConfigurationError) as fault:
        load_settings(file)
    assert sentence in str(fault.value)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("variable", "value", "sentence"),
    [
        ("MULTIRADAR_SERVER__PORT", "1_0", "server.port: expected a number, was '1_0'"),
        ("MULTIRADAR_SERVER__PORT", "x", "server.port: expected a whole number, was 'x'"),
        (
            "MULTIRADAR_SERVER__PROT",
            "1",
            "server: unknown setting 'prot' (did you mean 'port'?); known: host, port",
        ),
        (
            "MULTIRADAR_PORT",
            "1",
            "unknown variable MULTIRADAR_PORT (did you mean MULTIRADAR_SERVER__PORT?)",
        ),
        (
            "MULTIRADAR_TRACKING_EPOCH_S",
            "1",
            "MULTIRADAR_TRACKING_EPOCH_S (did you mean MULTIRADAR_TRACKING__EPOCH_S?)",
        ),
        (
            "MULTIRADAR_SERVR__PORT",
            "1",
            "MULTIRADAR_SERVR__PORT (= '1'): unknown section 'servr' (did you mean 'server'",
        ),
        (
            "MULTIRADAR_REORDER_HORIZON_SEC",
            "4",
            "unknown variable MULTIRADAR_REORDER_HORIZON_SEC (did you mean "
            "MULTIRADAR_TRACKING__REORDER_HORIZON_S?)",
        ),
        ("MULTIRADAR_WORKRES", "2", "MULTIRADAR_WORKRES (did you mean MULTIRADAR_WORKERS?)"),
        ("MULTIRADAR_XYZ", "2", "MULTIRADAR_XYZ; settings are MULTIRADAR_SECTION__SETTING"),
    ],
)
def test_a_wrong_variable_is_reported(
    variable: str, value: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(variable, value)
    with pytest.raises(ConfigurationError) as fault:
        load_settings()
    assert sentence in str(fault.value)


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        (KEY_VARIABLE, "secret"),
        (TRACEBACK_VARIABLE, "1"),
        # Of Kubernetes, for a service of this name.
        ("MULTIRADAR_SERVICE_HOST", "10.0.0.1"),
        ("MULTIRADAR_LIVE_SERVICE_PORT_HTTP", "8321"),
        ("MULTIRADAR_PORT_8321_TCP_ADDR", "10.0.0.1"),
        ("MULTIRADAR_PORT", "tcp://10.0.0.1:8321"),
    ],
)
def test_variables_that_are_no_settings_are_ignored(
    variable: str, value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(variable, value)
    assert load_settings() == Settings()


def test_a_setting_outside_the_sections_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MULTIRADAR_WORKERS", "3")
    assert load_settings().workers == 3


def test_a_missing_file_is_reported(file: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"multiradar\.toml: no such file$"):
        load_settings(file)


def test_asterix_listens_only_if_configured_and_then_on_loopback(file: Path) -> None:
    assert load_settings().asterix.listen == ()
    file.write_text("[[asterix.listen]]\nport = 8600\n")
    (listener,) = load_settings(file).asterix.listen
    assert (listener.address, listener.interface) == ("127.0.0.1", "127.0.0.1")
    assert listener.label == "127.0.0.1-8600"


def test_listeners_and_outputs_are_bounded(file: Path) -> None:
    file.write_text("".join(f"[[asterix.listen]]\nport = {8600 + k}\n" for k in range(65)))
    with pytest.raises(ConfigurationError, match=r"asterix\.listen: .*at most 64 items"):
        load_settings(file)
    file.write_text("".join(f"[[asterix.output]]\nport = {8600 + k}\n" for k in range(65)))
    with pytest.raises(ConfigurationError, match=r"asterix\.output: .*at most 64 items"):
        load_settings(file)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("address = 'radar.example'\nport = 1", "listen[0].address: expected an IPv4 address"),
        (
            "port = 65536",
            "line 2: asterix.listen[0].port: expected a number from 0 to 65535, was 65536",
        ),
        ("address = '127.0.0.1'", "line 1: asterix.listen[0].port: missing"),
        ("port = 1\nname = 'a b'", "line 3: asterix.listen a b: name: expected text of the form"),
        (
            "port = 1\nreceive_buffer_octets = 2147483648",
            "listen[0].receive_buffer_octets: expected a number from 1 to 2147483647, was 214748",
        ),
        ("port = 1\n[[asterix.listen]]\nport = 1", "each listener name once, found"),
    ],
)
def test_a_wrong_listener_is_reported(text: str, sentence: str, file: Path) -> None:
    file.write_text(f"[[asterix.listen]]\n{text}\n")
    with pytest.raises(ConfigurationError) as fault:
        load_settings(file)
    assert sentence in str(fault.value)


def test_system_tracks_are_sent_only_if_configured_and_then_to_loopback(file: Path) -> None:
    assert load_settings().asterix.output == ()
    file.write_text("[[asterix.output]]\nport = 8662\n[[asterix.output]]\nfile = 'a/b.ast'\n")
    display, recorder = load_settings(file).asterix.output
    assert (display.address, display.interface, display.ttl) == ("127.0.0.1", "127.0.0.1", 1)
    assert (display.label, recorder.label) == ("127.0.0.1-8662", "b.ast")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("sac = 1", "output[0]: expected either port or file, found neither"),
        ("port = 1\nfile = 'x'", "output[0]: expected either port or file, found both"),
        ("port = 0", "output[0].port: expected a number of at least 1, was 0"),
        (
            "port = 1\nsend_buffer_octets = 2147483648",
            "output[0].send_buffer_octets: expected a number from 1 to 2147483647, was 2147483648",
        ),
        ("port = 1\nsac = 256", "output[0].sac: expected a number from 0 to 255, was 256"),
        ("port = 1\nperiod_s = 0.7", "output[0].period_s: expected a multiple of 0.5"),
        (
            "port = 1\narea_deg = [0, 50, 5, 40]",
            "output[0]: area_deg: expected south below north, was 50 and 40",
        ),
        ("port = 1\narea_deg = [0, 50, 5]", "output[0].area_deg"),
        ("port = 1\nplane_centre_deg = [90, 5]", "output[0].plane_centre_deg"),
        ("port = 1\n[[asterix.output]]\nport = 1", "each output name once, found"),
    ],
)
def test_a_wrong_output_is_reported(text: str, sentence: str, file: Path) -> None:
    file.write_text(f"[[asterix.output]]\n{text}\n")
    with pytest.raises(ConfigurationError) as fault:
        load_settings(file)
    assert sentence in str(fault.value)


@pytest.mark.fault(30)
def test_all_mistakes_of_a_file_are_reported_with_their_lines(file: Path) -> None:
    file.write_text("epoch_s = 4\n\n[tracking]\nepochs = 4\n\n[server]\nport = -1\n")
    with pytest.raises(ConfigurationError) as fault:
        load_settings(file)
    assert fault.value.source == str(file)
    assert [one.partition("; known")[0] for one in fault.value.mistakes] == [
        "line 1: unknown setting 'epoch_s'; this setting belongs in [tracking]",
        "line 4: tracking: unknown setting 'epochs' (did you mean 'epoch_s'?)",
        "line 7: server.port: expected a number from 0 to 65535, was -1",
    ]


def test_an_error_in_an_option_has_no_line_of_the_file(file: Path) -> None:
    file.write_text("[server]\nport = 1\n")
    with pytest.raises(ConfigurationError) as fault:
        load_settings(file, {"server": {"port": -1}})
    assert "line" not in str(fault.value)


def test_feeds_connect_only_where_configured(file: Path) -> None:
    assert load_settings().feeds.source == ()
    file.write_text('[[feeds.source]]\nurl = "tcp://roof.example:30047"\n')
    (source,) = load_settings(file).feeds.source
    assert source.address == ("tcp", "roof.example", 30047, "")
    assert (source.label, source.sensor, source.times) == ("roof.example:30047", "adsb", "message")
    for url, address in (
        ("http://roof/tar1090/data/aircraft.json?a=1",
         ("http", "roof", 80, "/tar1090/data/aircraft.json?a=1")),
        ("https://roof:8443", ("https", "roof", 8443, "/")),
        ("file:///run/readsb/aircraft.json", ("file", "", 0, "/run/readsb/aircraft.json")),
        ("listen://[::1]:0", ("listen", "::1", 0, "")),
    ):  # fmt: skip
        file.write_text(f'[[feeds.source]]\nurl = "{url}"\n')
        assert load_settings(file).feeds.source[0].address == address


@pytest.mark.parametrize(
    "url",
    ["roof:30047", "tcp://roof", "tcp://roof:0", "tcp://roof:70000", "tcp://roof:1/path", "udp://roof:1",
     "http://user:secret@roof/", "file://roof/aircraft.json", "file:aircraft.json", "http://", ""],
)  # fmt: skip
def test_a_wrong_address_of_a_feed_is_reported(url: str, file: Path) -> None:
    file.write_text(f'[[feeds.source]]\nurl = "{url}"\n')
    with pytest.raises(
        ConfigurationError, match=r"feeds.source.*expected an address such as tcp://"
    ):
        load_settings(file)
    file.write_text(f'[[asterix.connect]]\nurl = "{url}"\n')
    with pytest.raises(ConfigurationError, match=r"asterix.connect.*expected an address such as"):
        load_settings(file)


def test_two_feeds_of_one_name_are_reported(file: Path) -> None:
    file.write_text('[[feeds.source]]\nurl = "tcp://a:1"\nname = "x"\n' * 2)
    with pytest.raises(ConfigurationError, match="each source name once, found x twice"):
        load_settings(file)


_REGION = "[region]\nname = 'west'\nlatitude_deg = 49.0\nlongitude_deg = 8.0\n"
_EAST = "[[region.neighbours]]\nname = 'east'\nlatitude_deg = 49.0\nlongitude_deg = 14.0\n"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[region]\nmargin_m = 1.0\n", "name: missing; specify the name of the region"),
        ("[region]\nname = 'west'\n", "specify the centre of the region"),
        (_REGION, "at least one table [[region.neighbours]]"),
        (_REGION + _EAST.replace("east", "west"), "each region name once, found west twice"),
        (_REGION + _EAST + _EAST, "each region name once, found east twice"),
        (_REGION + _EAST.replace("14.0", "8.0"), "west and east are closer together"),
        (_REGION + "margin_m = -1.0\n" + _EAST, "margin_m: expected a number of at least 0"),
        (
            _REGION + "silence_s = 1.5\n" + _EAST,
            "silence_s: expected at least twice period_s, was 1.5",
        ),
    ],
)
def test_a_region_without_an_area_is_reported(file: Path, text: str, sentence: str) -> None:
    file.write_text(text)
    with pytest.raises(ConfigurationError) as fault:
        load_settings(file)
    assert sentence in str(fault.value)


def test_a_region_has_neighbours_and_without_the_section_there_is_none(file: Path) -> None:
    assert load_settings().region.name is None
    file.write_text(_REGION + _EAST)
    region = load_settings(file).region
    assert (region.name, [one.name for one in region.neighbours]) == ("west", ["east"])
