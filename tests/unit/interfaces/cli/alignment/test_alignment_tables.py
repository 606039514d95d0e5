"""Tables and sensors file of a registration."""

from multiradar.toolbox.alignment.sensors_file import aligned_sensors
from multiradar.toolbox.alignment.tables import alignment_document
from multiradar_schemas.alignment import (
    AlignedBias,
    AlignedDistances,
    AlignedInput,
    AlignedResiduals,
    AlignedUnobservable,
    Alignment,
)
from multiradar_schemas.report import Counts
from multiradar_schemas.sensors.sensor import parse_sensors

DISTANCES = AlignedDistances(median_m=1.0, rms_m=2.0, percentile_90_m=3.0)
RESIDUALS = AlignedResiduals(pairs=7, aircraft=2, before=DISTANCES, after=DISTANCES, best=DISTANCES)
SENSORS = """
[[sensor]]
id = "odd-name"
kind = "adsb"

[[sensor]]
id = "R"
kind = "radar"
latitude_deg = 47.0
longitude_deg = 8.0
height_m = 300
also = ["R-2"]
bias.range_offset_m = { prior = 5.0, drift = 0.01 }
bias.range_gain = { estimate = false, prior = 0.001 }
"""


def bias(parameter: str, estimate: float, sigma: float, **more: object) -> AlignedBias:
    values: dict[str, object] = {
        "sensor_id": "R", "parameter": parameter, "estimate": estimate, "sigma": sigma,
        "prior_ratio": 0.1, "drift_per_h": None, "drift_sigma_per_h": None, "drifts": False,
    }  # fmt: skip
    return AlignedBias.model_validate(values | more)


def alignment(*biases: AlignedBias) -> Alignment:
    return Alignment(
        inputs=[AlignedInput(file="folder/a.ast", counts=None)],
        counts=Counts(read=10, accepted=10, rejected=0), first_s=None, last_s=None, tracks=2,
        track_fraction=1.0, folds=2, pair_time_s=2.0, residuals=RESIDUALS, biases=[*biases],
        radars=[], pairs=[], trend=[], warnings=["the first"], sensors_toml="",
        unobservable=[AlignedUnobservable(what="range offset of R", prior_ratio=0.97)],
    )  # fmt: skip


def test_two_parameters_are_side_by_side_with_remarks() -> None:
    found = alignment(
        bias("range_offset_m", -12.34, 1.5, prior_ratio=0.8),
        bias("azimuth_offset_deg", 0.1, 0.01, drift_per_h=0.5, drift_sigma_per_h=0.1, drifts=True),
    )
    document = alignment_document(found, "command")
    table = document.tables[0]
    assert table.header == (
        "sensor", "range offset, m", "sigma", "per hour", "azimuth offset, °", "sigma", "per hour",
        "remarks",
    )  # fmt: skip
    remarks = "range offset not observed, azimuth offset drifts"
    assert table.rows == (
        ("R", "−12.3", "1.5", None, "0.100", "0.010", "0.50 ± 0.10", remarks),
    )  # fmt: skip
    assert document.title == "Registration: a.ast"
    assert document.notes[:2] == [
        "Not observable: range offset of R (sigma still 97% of the prior).",
        "The first.",
    ]


def test_more_parameters_have_rows() -> None:
    names = ("range_offset_m", "azimuth_offset_deg", "range_gain")
    table = alignment_document(alignment(*(bias(n, 1.0, 0.1) for n in names)), "c").tables[0]
    assert table.header == ("sensor", "bias", "estimate", "sigma", "remarks")
    assert [row[1] for row in table.rows] == ["range offset, m", "azimuth offset, °", "range gain"]


def test_the_sensors_file_keeps_everything_else() -> None:
    before = parse_sensors(SENSORS)
    text = aligned_sensors(
        before,
        [bias("range_offset_m", 123.456, 1.23), bias("azimuth_offset_deg", -3e-5, 4e-6)],
        "multiradar align x\n--sensors y",
    )
    after = parse_sensors(text)
    assert after.sensor[0] == before.sensor[0]
    radar = after.sensor[1].bias
    assert (radar.range_offset_m.prior, radar.range_offset_m.prior_sigma) == (123.46, 1.23)
    assert radar.range_offset_m.drift == 0.01
    assert (radar.azimuth_offset_deg.prior, radar.azimuth_offset_deg.prior_sigma) == (-3e-5, 4e-6)
    assert radar.range_gain == before.sensor[1].bias.range_gain
    assert after.sensor[1].also == ("R-2",)


def test_a_bias_beyond_the_bounds_is_written_at_the_bound() -> None:
    text = aligned_sensors(parse_sensors(SENSORS), [bias("range_offset_m", 3e4, 2e4)], "c")
    prior = parse_sensors(text).sensor[1].bias.range_offset_m
    assert (prior.prior, prior.prior_sigma) == (2e4, 1e4)
