"""Elevations and positions of moving sensors, from the wire to the core and back."""

import hashlib
import json
from dataclasses import asdict, fields

import numpy as np
import polars as pl
import pytest

from multiradar.estimation.measurement.sensors import LATER_FIELDS, SensorTable
from multiradar.runtime.admission.admission_by_time import FORWARD_JUMP_MAX_S
from multiradar.runtime.engine.fingerprint import OUTPUT_RULES, configuration_fingerprint
from multiradar.runtime.live.intake import Submission
from multiradar.runtime.live.payload import decode_rows, encode_rows
from multiradar.runtime.live.preparation import same_message
from multiradar.storage.entries import Entry, EntryKind
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.input.order import canonical_order
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, measurement_rows, sensor_table
from multiradar_compiled.arithmetic_kernels import arithmetic
from multiradar_converters.normalised.arrow import parse_arrow
from multiradar_converters.normalised.text import parse_json, parse_ndjson
from multiradar_schemas.errors import DocumentError
from multiradar_schemas.measurements.columns import MEASUREMENT_AIRCRAFT, MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA
from multiradar_schemas.reject import RejectCode
from multiradar_schemas.sensors.sensor import parse_sensors

SENSORS = """
    [[sensor]]
    id = "df"
    kind = "direction-finder"
    latitude_deg = 50
    longitude_deg = 15
    height_m = 300
    {more}
"""
PLAIN = sensor_table(parse_sensors(SENSORS.format(more="")))
ELEVATED = sensor_table(parse_sensors(SENSORS.format(more="elevation_sigma_deg = 0.2")))
MOVING = sensor_table(
    parse_sensors(SENSORS.format(more="elevation_sigma_deg = 0.2\nmoving = true"))
)
RADAR = SENSORS.format(more="").replace("direction-finder", "radar").replace('"df"', '"radar"')
MIXED = sensor_table(parse_sensors(RADAR + SENSORS.format(more="moving = true")))
BEARING = {"time_s": 100.0, "sensor_id": "df", "kind": "bearing", "azimuth_deg": 30.0}
SOURCE = {"source_latitude_deg": 50.5, "source_longitude_deg": 15.5, "source_height_m": 4000.0}


def translated(table: SensorTable, *rows: dict[str, object]) -> tuple[MeasurementBatch, list[str]]:
    frame = pl.DataFrame(list(rows), schema=MEASUREMENT_SCHEMA)
    batch, rejected = measurement_batch(frame, table)
    assert len(batch) + len(rejected) == len(rows)
    return batch, [
        f"{code}: {why}" for code, why in zip(rejected.code, rejected.reason, strict=True)
    ]


def test_columns_come_through_in_every_encoding() -> None:
    row = BEARING | SOURCE | {"elevation_deg": -1.5}
    frame = pl.DataFrame([row], schema={name: MEASUREMENT_SCHEMA[name] for name in row})
    bodies = (
        parse_json(json.dumps([row]).encode()),
        parse_ndjson(json.dumps(row).encode()),
        parse_arrow(encode_rows(frame)),
    )
    for parsed in bodies:
        assert not parsed.rejected
        batch, rejected = measurement_batch(parsed.frame, MOVING)
        assert not len(rejected)
        directions = batch.directions
        assert directions is not None
        assert np.degrees(directions.elevation_rad[0]) == pytest.approx(-1.5, abs=1e-12)
        assert np.degrees(directions.source_latitude_rad[0]) == pytest.approx(50.5, abs=1e-12)
        assert np.degrees(directions.source_longitude_rad[0]) == pytest.approx(15.5, abs=1e-12)
        assert directions.source_height_m[0] == 4000.0
        (back,) = measurement_rows(batch, MOVING)
        assert {name: back[name] for name in SOURCE} == pytest.approx(SOURCE)


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"elevation_deg": 90.1}, RejectCode.OUT_OF_RANGE),
        ({"elevation_deg": -91}, RejectCode.OUT_OF_RANGE),
        ({"source_latitude_deg": 50.0}, RejectCode.MISSING_FIELD),
        (SOURCE | {"source_height_m": None}, RejectCode.MISSING_FIELD),
        (SOURCE | {"source_latitude_deg": 95.0}, RejectCode.OUT_OF_RANGE),
        (SOURCE | {"source_height_m": 50e3}, RejectCode.OUT_OF_RANGE),
        ({"elevation_deg": 3.0, "azimuth_deg": None}, RejectCode.MISSING_FIELD),
    ],
)
def test_implausible_directions_are_rejected_in_every_encoding(
    fields: dict[str, object], code: RejectCode
) -> None:
    row = {**BEARING, **fields}
    assert [one.code for one in parse_json(json.dumps([row]).encode()).rejected] == [code]
    frame = pl.DataFrame([row], schema={name: MEASUREMENT_SCHEMA[name] for name in row})
    (rejected,) = parse_arrow(encode_rows(frame)).rejected
    assert rejected.code is code
    assert "expected" in rejected.reason
    assert [why.partition(":")[0] for why in translated(MOVING, row)[1]] == [str(code)]


@pytest.mark.parametrize("missing", list(SOURCE))
def test_an_incomplete_sensor_position_is_rejected_with_one_reason(missing: str) -> None:
    """Once the reason ended with the whole row."""
    row = BEARING | {name: value for name, value in SOURCE.items() if name != missing}
    expected = f"{missing}: missing; expected all of {', '.join(SOURCE)} or none"
    assert [one.reason for one in parse_json(json.dumps([row]).encode()).rejected] == [expected]
    frame = pl.DataFrame([row], schema={name: MEASUREMENT_SCHEMA[name] for name in row})
    assert [one.reason for one in parse_arrow(encode_rows(frame)).rejected] == [expected]


def test_a_sensor_reports_only_its_configured_measurements() -> None:
    plot = BEARING | {"sensor_id": "radar", "kind": "radar", "range_m": 9e4}
    for table, row, words in (
        (PLAIN, BEARING | {"elevation_deg": 1.0}, "expected no elevation"),
        (ELEVATED, BEARING | SOURCE, "expected no source position"),
        (MOVING, BEARING, "expected all of source_latitude_deg"),
        (MIXED, plot | SOURCE, "expected no source position"),
    ):
        batch, (why,) = translated(table, row)
        assert not len(batch)
        assert words in why
    batch, rejected = translated(ELEVATED, BEARING, BEARING | {"elevation_deg": 1.0})
    assert not rejected
    assert batch.directions is not None
    assert np.isnan(batch.directions.elevation_rad).tolist() == [True, False]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('kind = "radar"\nmoving = true', "moving does not apply to the radar"),
        ('kind = "mlat"\nelevation_sigma_deg = 1', "elevation_sigma_deg does not apply"),
        ("moving = true\nbias.time_offset_s.estimate = true", "time_offset_s does not apply"),
        ("elevation_sigma_deg = 0", "elevation_sigma_deg"),
    ],
)
def test_an_implausible_sensors_file_is_rejected(more: str, words: str) -> None:
    text = SENSORS.format(more=more)
    if "kind" in more:
        text = text.replace('kind = "direction-finder"\n', "")
    with pytest.raises(DocumentError, match=words):
        parse_sensors(text)


def test_rows_are_ordered_by_their_directions_too() -> None:
    rows = [
        BEARING | SOURCE | {"elevation_deg": 2.0},
        BEARING | SOURCE,
        BEARING | SOURCE | {"elevation_deg": 1.0},
        BEARING | SOURCE | {"source_longitude_deg": 15.4, "elevation_deg": 1.0},
    ]
    batch, _ = translated(MOVING, *rows)
    # By elevation, missing ones last, then by position.
    assert canonical_order(batch).tolist() == [3, 2, 0, 1]
    turned, _ = translated(MOVING, *reversed(rows))
    assert canonical_order(turned).tolist() == [0, 1, 3, 2]


def test_batches_with_and_without_directions_join() -> None:
    plain, _ = translated(PLAIN, BEARING)
    assert plain.directions is None
    moved, _ = translated(MOVING, BEARING | SOURCE)
    joined = MeasurementBatch.concatenate([plain, moved])
    assert joined.directions is not None
    assert joined.directions.moves.tolist() == [False, True]
    assert joined.select(slice(0, 1)).directions is None
    assert joined.select(slice(1, 2)).directions is not None


def test_a_journal_without_directions_is_unchanged() -> None:
    """Bytes of earlier versions are read, and written, where there are no directions."""
    old = PLAIN_SCHEMA.names()
    whole = pl.DataFrame([BEARING], schema=MEASUREMENT_SCHEMA)
    assert decode_rows(encode_rows(whole)).columns == old
    batch, rejected = measurement_batch(decode_rows(encode_rows(whole)), PLAIN)
    assert len(batch) == 1
    assert not len(rejected)
    directions = pl.DataFrame([BEARING | SOURCE], schema=MEASUREMENT_SCHEMA)
    assert decode_rows(encode_rows(directions)).equals(
        directions.drop("on_ground", "position_sigma_m", "detection", *MEASUREMENT_AIRCRAFT)
    )


def test_messages_with_different_directions_differ() -> None:
    def submission(*rows: dict[str, object]) -> Submission:
        frame = pl.DataFrame(list(rows), schema=MEASUREMENT_SCHEMA)
        return Submission(EntryKind.BATCH, frame, "test", "key", ())

    raised = BEARING | {"elevation_deg": 1.0}
    for stored, sent, same in (
        (raised, raised, True),
        (raised, BEARING, False),
        (BEARING, raised, False),
        (BEARING, BEARING, True),
        (raised, BEARING | {"elevation_deg": 2.0}, False),
        (BEARING | SOURCE, BEARING | SOURCE | {"source_height_m": 1.0}, False),
    ):
        payload = encode_rows(submission(stored).frame)
        entry = Entry(EntryKind.BATCH, "test", "key", payload, 1, (), "")
        assert same_message(submission(sent), entry) is same


def test_a_configuration_without_them_has_the_fingerprint_that_it_had() -> None:
    """A journal of an earlier version is continued."""
    tracking = TrackingSettings()
    known = [configuration_fingerprint(one, tracking) for one in (PLAIN, ELEVATED, MOVING)]
    assert len(set(known)) == 3
    # As the version before them made it.
    whole = hashlib.sha256(f"rules={OUTPUT_RULES};arithmetic={arithmetic()};".encode())
    for name, value in sorted(asdict(tracking).items()):
        whole.update(f"{name}={value!r};".encode())
    whole.update(f"forward_jump_max_s={FORWARD_JUMP_MAX_S!r};".encode())
    whole.update(b"df;aliases=()")
    for field in fields(PLAIN):
        value = getattr(PLAIN, field.name)
        if isinstance(value, np.ndarray) and field.name not in LATER_FIELDS:
            whole.update(f";{field.name}:{value.dtype.str}:".encode() + value.tobytes())
    assert known[0] == whole.hexdigest()
