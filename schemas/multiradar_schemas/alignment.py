"""Registration of radars from recordings, as `multiradar align --json` prints it."""

from typing import Annotated, Any

from multiradar_schemas.base import Record, described
from multiradar_schemas.report import Count, Counts

_OF_PARAMETER = "of the parameter"


def _number(description: str, unit: str, absent: str = "never") -> Any:
    return described(description, unit=unit, source="align", absent=absent)


def _text(description: str, absent: str = "never") -> Any:
    return described(description, unit="text", source="align", absent=absent)


class AlignedInput(Record):
    """A recording."""

    file: Annotated[str, _text("The file or directory")]
    counts: Annotated[
        Counts | None,
        _number("Counts of records in the file", "1", "already converted: counted as measurements"),
    ]


class AlignedDistances(Record):
    """Distances between the two plots of pairs."""

    median_m: Annotated[float, _number("Median", "m")]
    rms_m: Annotated[float, _number("Root mean square", "m")]
    percentile_90_m: Annotated[float, _number("90th percentile", "m")]


class AlignedResiduals(Record):
    """Distances of the same pairs with different biases."""

    pairs: Annotated[Count, _number("Number of pairs of plots", "1")]
    aircraft: Annotated[Count, _number("Number of aircraft in these pairs", "1")]
    before: Annotated[AlignedDistances | None, _number("Before bias correction", "m", "no pairs")]
    after: Annotated[
        AlignedDistances | None,
        _number(
            "After correction with biases fitted without the aircraft of the pair",
            "m",
            "one aircraft",
        ),
    ]
    best: Annotated[
        AlignedDistances | None,
        _number(
            "After correction with biases fitted to all aircraft: the noise floor", "m", "no pairs"
        ),
    ]


class AlignedBias(Record):
    """A bias of a sensor, measured minus true."""

    sensor_id: Annotated[str, _text("The sensor")]
    parameter: Annotated[str, _text("The parameter, as in `sensors.toml`")]
    estimate: Annotated[float, _number("Estimate", _OF_PARAMETER)]
    sigma: Annotated[float, _number("Standard deviation of the estimate", _OF_PARAMETER)]
    prior_ratio: Annotated[float, _number("Sigma / prior sigma", "1")]
    drift_per_h: Annotated[
        float | None,
        _number("Slope of the trend", f"{_OF_PARAMETER} / h", "fewer than three intervals"),
    ]
    drift_sigma_per_h: Annotated[
        float | None, _number("Standard deviation of the slope", f"{_OF_PARAMETER} / h", "no slope")
    ]
    drifts: Annotated[
        bool,
        _number(
            "Whether the slope exceeds four times its sigma; `estimate` is then a mean over time",
            "true or false",
        ),
    ]


class AlignedInterval(Record):
    """A bias in an interval of time."""

    time_s: Annotated[float, _number("Centre of the interval", "s")]
    sensor_id: Annotated[str, _text("The sensor")]
    parameter: Annotated[str, _text("The parameter")]
    estimate: Annotated[
        float, _number("Estimate from the plot pairs in the interval", _OF_PARAMETER)
    ]
    sigma: Annotated[float, _number("Standard deviation of the estimate", _OF_PARAMETER)]


class AlignedRadar(Record):
    """A radar compared with all others, from its pairs, with residuals of withheld aircraft."""

    sensor_id: Annotated[str, _text("The radar")]
    residuals: Annotated[
        AlignedResiduals, _number("Residuals of the pairs that contain the radar", "residuals")
    ]
    range_before_m: Annotated[
        float | None,
        _number(
            "Median of the measured range minus the range computed from the positions of other "
            "sensors, before correction",
            "m",
            "no pairs",
        ),
    ]
    range_after_m: Annotated[
        float | None, _number("The same median after correction", "m", "no pairs")
    ]
    range_spread_m: Annotated[
        float | None, _number("Robust standard deviation after correction", "m", "no pairs")
    ]
    azimuth_before_deg: Annotated[
        float | None,
        _number(
            "Median of the measured azimuth minus the azimuth computed from the positions of "
            "other sensors, before correction",
            "degree",
            "no pairs",
        ),
    ]
    azimuth_after_deg: Annotated[
        float | None, _number("The same median after correction", "degree", "no pairs")
    ]
    azimuth_spread_deg: Annotated[
        float | None, _number("Robust standard deviation after correction", "degree", "no pairs")
    ]
    range_noise_m: Annotated[
        float | None, _number("Estimated random range error, 1 sigma", "m", "no pairs")
    ]
    azimuth_noise_deg: Annotated[
        float | None, _number("Estimated random azimuth error, 1 sigma", "degree", "no pairs")
    ]


class AlignedPair(Record):
    """Two sensors."""

    first: Annotated[str, _text("The first sensor")]
    second: Annotated[str, _text("The second sensor")]
    residuals: Annotated[
        AlignedResiduals, _number("Residuals of the pairs of these two sensors", "residuals")
    ]


class AlignedUnobservable(Record):
    """Biases that the recording does not determine."""

    what: Annotated[str, _text("A bias, or a combination of biases")]
    prior_ratio: Annotated[float, _number("Sigma / prior sigma", "1")]


class Alignment(Record):
    """Registration of radars."""

    inputs: Annotated[list[AlignedInput], _number("The recordings", "inputs")]
    counts: Annotated[Counts, _number("Counts of the measurements of the selected kinds", "1")]
    first_s: Annotated[
        float | None, _number("Time of the first measurement", "s", "no measurements")
    ]
    last_s: Annotated[float | None, _number("Time of the last measurement", "s", "no measurements")]
    tracks: Annotated[Count, _number("Number of confirmed tracks", "1")]
    track_fraction: Annotated[float, _number("Fraction of the tracks used", "1")]
    folds: Annotated[
        Count,
        _number(
            "Number of cross-validation folds; each withholds some of the aircraft; 1: no "
            "aircraft was withheld",
            "1",
        ),
    ]
    pair_time_s: Annotated[float, _number("Maximum time between the plots of a pair", "s")]
    residuals: Annotated[AlignedResiduals, _number("Residuals of all pairs", "residuals")]
    biases: Annotated[list[AlignedBias], _number("Final biases", "biases")]
    radars: Annotated[list[AlignedRadar], _number("Results for each radar", "radars")]
    pairs: Annotated[list[AlignedPair], _number("Results for each pair of sensors", "pairs")]
    unobservable: Annotated[
        list[AlignedUnobservable],
        _number("Biases that are not observable from the recording", "unobservable"),
    ]
    trend: Annotated[list[AlignedInterval], _number("Biases over time", "trend")]
    warnings: Annotated[list[str], _text("Limitations of the result")]
    sensors_toml: Annotated[str, _text("The sensors file, with the biases as priors")]
