"""Bad input gets from Python the sentence of the command, as an exception with its data."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl
import pytest

import multiradar as mr
from multiradar.cli.main import EXIT_FAILED, EXIT_USAGE, run
from multiradar.errors import (
    ArgumentError,
    ConfigurationError,
    DataWarning,
    FindingsError,
    InputError,
    MissingColumnError,
    MultiradarError,
    OutputExistsError,
    UnknownFilterError,
)
from multiradar.toolbox.conversion.convert import Conversion


def _table(made: Path) -> pl.DataFrame:
    return pl.read_parquet(made / "scene" / "measurements.parquet")


def _sensors(made: Path) -> Path:
    return made / "scene" / "sensors.toml"


def test_a_table_without_a_column_says_which_and_which_is_nearest(made: Path) -> None:
    frame = _table(made).rename({"azimuth_deg": "azimut_deg"})
    with pytest.raises(MissingColumnError) as caught:
        mr.track(frame, _sensors(made))
    assert caught.value.missing == ("azimuth_deg",)
    text = "measurements: missing column azimuth_deg (rename azimut_deg to azimuth_deg?); found: "
    assert str(caught.value).startswith(text)
    with mr.Tracker(_sensors(made)) as tracker:
        with pytest.raises(MissingColumnError) as pushed:
            tracker.push(frame)
        assert tracker.counts["read"] == 0
    assert str(pushed.value) == str(caught.value)


def test_a_column_of_another_type_is_named(made: Path) -> None:
    frame = _table(made).with_columns(range_m=pl.lit("far"))
    expected = "measurements: expected Float64 in the column range_m, found String"
    with pytest.raises(InputError, match=expected):
        mr.track(frame, _sensors(made))


@pytest.mark.parametrize("name", ["workers", "batch"])
@pytest.mark.parametrize("value", [0, -1])
def test_numbers_of_workers_and_rows_are_at_least_one(made: Path, name: Any, value: Any) -> None:
    options: Any = {name: value}
    with pytest.raises(ArgumentError, match=f"`{name}`: expected a whole number of at least 1"):
        mr.track(_table(made), _sensors(made), **options)


def test_options_of_a_conversion_are_checked(tmp_path: Path) -> None:
    file = tmp_path / "a.ast"
    file.write_bytes(b"\x30\x00\x03")
    sensors: Any = 5
    with pytest.raises(ArgumentError, match=r"`sensors`: expected the path of a sensors.toml, or"):
        mr.convert(file, sensors=sensors)
    # A single text is no list of letters.
    with pytest.raises(ArgumentError, match=r"`edition`: .* was '021'"):
        mr.convert(file, edition="021")


def test_an_empty_table_is_an_error(made: Path) -> None:
    with pytest.raises(InputError, match=r"^measurements: no measurements$"):
        mr.track(_table(made)[:0], _sensors(made))
    tables: tuple[Any, ...] = ([], {}, pl.DataFrame(), [{}])
    for empty in tables:
        with pytest.raises(InputError, match="measurements: an empty table, without columns"):
            mr.track(empty, _sensors(made))


def test_an_empty_text_is_no_path(made: Path) -> None:
    """Regression: it was taken for the working directory."""
    for call, name in (
        (lambda: mr.track("", _sensors(made)), "measurements"),
        (lambda: mr.track(made / "scene", ""), "sensors"),
        (lambda: mr.convert(made / "scene", out=""), "out"),
    ):
        with pytest.raises(ArgumentError, match=f"`{name}`: expected a path, was an empty text"):
            call()


@pytest.mark.parametrize(
    ("options", "kind", "sentence"),
    [
        ({"kinds": ["radr"]}, ArgumentError, "`kinds`: unknown kind 'radr' (did you mean 'radar'"),
        ({"kinds": []}, ArgumentError, "`kinds`: expected at least one of radar, adsb, mlat, bea"),
        ({"hide": ["mode3a"]}, ArgumentError, "`hide`: unknown field 'mode3a'"),
        (
            {"filter": "im"},
            UnknownFilterError,
            "unknown filter 'im' (did you mean 'imm'?)",
        ),
        ({"epoch_s": -1.0}, ArgumentError, "`epoch_s`: expected"),
        ({"encounter_distance_m": 9.0}, ArgumentError, "`encounter_distance_m` requires `enc"),
        ({"encounters": 1e9}, ArgumentError, "`encounters`: expected 1 to 600, was 1000000000.0"),
        ({"processor": "1-2"}, ArgumentError, "`processor` requires `reference`"),
        ({"date": "1 May"}, ArgumentError, "`date`: expected a date such as 2018-08-01"),
        ({"date": "2018-08-01"}, ArgumentError, "`date` applies to a dump directory only"),
        ({"config": "none.toml"}, ConfigurationError, "none.toml: no such file"),
        (
            {"epochs": 3},
            ArgumentError,
            "unknown argument `epochs` (did you mean",
        ),
    ],
)
def test_an_argument_that_cannot_be_used_is_named(
    made: Path, options: dict[str, Any], kind: type[Exception], sentence: str
) -> None:
    with pytest.raises(kind) as caught:
        mr.track(made / "scene", _sensors(made), **options)
    assert str(caught.value).startswith(sentence)


@pytest.mark.parametrize(
    ("arguments", "call"),
    [
        (
            ["track", "SCENE", "--sensors", "SENSORS", "--out", "OUT", "--processor", "1-2"],
            lambda made, out: mr.track(made / "scene", _sensors(made), out=out, processor="1-2"),
        ),
        (
            ["track", "none", "--sensors", "SENSORS", "--out", "OUT"],
            lambda made, out: mr.track("none", _sensors(made), out=out),
        ),
        (
            ["track", "SCENE", "--sensors", "none.toml", "--out", "OUT"],
            lambda made, out: mr.track(made / "scene", "none.toml", out=out),
        ),
        (
            ["track", "SCENE", "--sensors", "SENSORS", "--out", "SCENE"],
            lambda made, _out: mr.track(made / "scene", _sensors(made), out=made / "scene"),
        ),
        (["evaluate", "TRACKS"], lambda made, _out: mr.evaluate(made / "tracks")),
        (
            ["evaluate", "TRACKS", "--truth", "SCENE", "--adsb", "SCENE"],
            lambda made, _out: mr.evaluate(
                made / "tracks", truth=made / "scene", adsb=made / "scene"
            ),
        ),
        (
            ["evaluate", "SCENE", "--truth", "SCENE"],
            lambda made, _out: mr.evaluate(made / "scene", truth=made / "scene"),
        ),
        (
            ["simulate", "crosing", "--out", "OUT"],
            lambda _made, out: mr.simulate("crosing", out=out),
        ),
        (["convert", "adsb", "none", "--out", "OUT"],
         lambda _made, out: mr.convert("none", out=out, format="adsb")),
    ],
)  # fmt: skip
def test_the_sentence_is_that_of_the_command(
    made: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    call: Callable[[Path, Path], object],
) -> None:
    out = tmp_path / "out"
    paths = {"SCENE": made / "scene", "TRACKS": made / "tracks", "SENSORS": _sensors(made),
             "OUT": out}  # fmt: skip
    status = run([str(paths.get(argument, argument)) for argument in arguments])
    # Lines about kernels may precede it.
    shown = capsys.readouterr().err.splitlines()[-1].removeprefix("multiradar: ")
    with pytest.raises((InputError, ConfigurationError, OutputExistsError)) as caught:
        call(made, out)
    error, called, expected = caught.value, str(caught.value), EXIT_FAILED
    if isinstance(error, ArgumentError):
        called, expected = error.sentence_of(lambda n: f"--{n.replace('_', '-')}"), EXIT_USAGE
    assert status == expected
    assert shown == called
    assert not out.exists()


def test_a_registered_name_must_be_its_own() -> None:
    with pytest.raises(ArgumentError, match="filter 'imm' already exists; choose another name"):
        mr.register_filter("imm", object)  # type: ignore[arg-type]
    with pytest.raises(UnknownFilterError, match="im"):
        mr.register_filter("mine", ConstantState, host="im")


def test_a_run_with_findings_is_kept_with_them(made: Path) -> None:
    frame = _table(made).with_columns(sensor_id=pl.lit("x"))
    with pytest.raises(FindingsError, match=r"none of .* measurements were accepted") as caught:
        mr.track(frame, _sensors(made))
    done = caught.value.output
    assert isinstance(done, mr.Run)
    assert done.report["counts"]["accepted"] == 0


def test_a_conversion_with_findings_is_kept_with_them(tmp_path: Path) -> None:
    reports = tmp_path / "reports.csv"
    rows = [f"{1_533_110_400 + k},3c6444,{47.0 + 0.1 * k},8.5,35000\n" for k in range(1000)]
    reports.write_text("timestamp,icao24,latitude,longitude,altitude\n" + "".join(rows))
    with pytest.raises(FindingsError, match=r"57% of its 1.000 records were rejected") as caught:
        mr.convert(reports)
    done = caught.value.output
    assert isinstance(done, Conversion)
    assert done.measurements.height == done.report["counts"]["accepted"] > 400


def test_rows_out_of_order_are_sorted_with_a_warning(made: Path, tracked: mr.Run) -> None:
    with pytest.warns(DataWarning, match="measurements: rows are up to .* out of order") as found:
        done = mr.track(_table(made).reverse(), _sensors(made))
    assert [one.filename for one in found] == [__file__]
    assert done.report["counts"]["read"] == tracked.report["counts"]["read"]


def test_the_output_of_another_command_is_no_run(made: Path) -> None:
    with pytest.raises(InputError, match="scene: expected the output of `track`, was the output"):
        mr.Run(made / "scene")


def test_a_setting_of_the_wrong_type_is_named_once(made: Path, tracked: mr.Run) -> None:
    settings: Any = {"gate_m": "2000"}
    with pytest.raises(ArgumentError) as caught:
        mr.evaluate(tracked, truth=made / "scene", **settings)
    assert str(caught.value) == "`gate_m`: expected a number, was '2000'"


def test_settings_of_a_bundle_are_checked() -> None:
    settings: Any = 5
    with pytest.raises(ArgumentError, match="`settings`: expected BundleSettings, was int"):
        mr.Bundle(settings)


@pytest.mark.filterwarnings("always::multiradar.errors.DataWarning")
def test_a_tracker_warns_where_all_measurements_are_rejected(made: Path) -> None:
    frame = _table(made).head(10)
    with mr.Tracker(_sensors(made)) as tracker:
        unknown = frame.with_columns(sensor_id=pl.lit("99-9"))
        with pytest.warns(DataWarning, match="all 10 measurements were rejected") as said:
            assert len(tracker.push(unknown).rejected) == 10
        assert "10 UNKNOWN_SENSOR; the first: sensor_id: expected a sensor" in str(said[0].message)
        mixed = pl.concat([frame.head(1), unknown.head(1)])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert len(tracker.push(mixed).rejected) == 1


@pytest.mark.filterwarnings("always::multiradar.errors.DataWarning")
def test_a_tracker_names_what_is_wrong_at_the_end_of_a_stream(made: Path) -> None:
    milliseconds = _table(made).with_columns(pl.col("time_s") * 1000.0)
    with mr.Tracker(_sensors(made)) as tracker:
        for part in milliseconds.iter_slices(500):
            tracker.push(part)
        with pytest.warns(DataWarning, match="times are probably in milliseconds"):
            tracker.flush()
        # Of what followed, which is nothing.
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            tracker.flush()


#: Not checked by mypy.
LOOSE: Any = mr


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (lambda made: LOOSE.track(_table(made), _sensors(made), epoc_s=4.0), "epoch_s"),
        (lambda made: LOOSE.track(_table(made), _sensors(made), filter="im"), "imm"),
        (lambda made: LOOSE.Tracker(_sensors(made), filter="IMM"), "imm"),
        (lambda made: LOOSE.Tracker(_sensors(made), epoch=4.0), "epoch_s"),
        (lambda made: LOOSE.convert(made / "scene", format="vidd"), "vid"),
        (lambda made: LOOSE.convert(made / "scene", format="vid", dat="2018-08-01"), "date"),
        (lambda _made: LOOSE.register_filter("own", ConstantState, host="im"), "imm"),
        (lambda made: _renamed(made, "height_m", "Heigth_m"), "rename Heigth_m to height_m"),
        (lambda made: _renamed(made, "time_s", "time"), "rename time to time_s"),
    ],
)
def test_the_nearest_name_is_given(made: Path, call: Callable[[Path], object], meant: str) -> None:
    with pytest.raises(MultiradarError) as caught:
        call(made)
    expected = meant if meant.startswith("rename") else f"did you mean '{meant}'?"
    assert expected in str(caught.value)


class ConstantState:
    """A filter whose state is always the same."""

    def update(self, _plot: object) -> tuple[list[float], list[list[float]]]:
        return [0.0] * 4, [[float(row == column) for column in range(4)] for row in range(4)]


def _renamed(made: Path, name: str, to: str) -> object:
    return mr.track(_table(made).rename({name: to}), _sensors(made))


def test_a_class_without_update_is_no_filter() -> None:
    wrong: Any = object
    with pytest.raises(ArgumentError, match="expected a class with a method `update`"):
        mr.register_filter("own", wrong)


def test_a_structured_array_with_missing_texts_is_a_table(made: Path) -> None:
    table = _table(made).with_columns(callsign=pl.lit(None, pl.String))
    array = table.to_numpy(structured=True)
    assert array.dtype["callsign"].kind == "O"
    given = mr.track(array, _sensors(made)).report["counts"]
    assert given == mr.track(table, _sensors(made)).report["counts"]


def test_what_simulate_returns_is_a_recording(made: Path) -> None:
    scene = mr.simulate("crossing", duration_s=60.0, seed=3)
    counts = mr.track(scene, scene.sensors).report["counts"]
    assert counts == mr.track(scene.folder, scene.sensors).report["counts"]
    with mr.Tracker(scene.sensors) as tracker:
        tracker.push(scene)
        assert tracker.counts["read"] == counts["read"]
