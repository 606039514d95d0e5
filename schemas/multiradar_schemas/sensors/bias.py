"""Bias priors in the sensors file."""

from typing import Annotated, Any

from pydantic import Field

from multiradar_schemas import bounds as bounds
from multiradar_schemas.base import described
from multiradar_schemas.bounds import Bounds, ParameterBounds
from multiradar_schemas.documents.tables import Table

#: Source of the fields.
FILE = "sensors.toml"


def of_file(description: str, unit: str, absent: str = "never") -> Any:
    """Return field information with the sensors file as source; see `described`."""
    return described(description, unit=unit, source=FILE, absent=absent)


def within(limits: Bounds) -> Any:
    """Return field information with inclusive bounds."""
    return Field(ge=limits.least, le=limits.most)


class BiasParameter(Table):
    """Prior of a bias; a bias is measured minus true.

    The bounds of each parameter are in the classes below.
    """

    estimate: Annotated[
        bool | None,
        of_file(
            "Whether the parameter is estimated", "true or false", "default of the sensor kind"
        ),
    ] = None
    prior: float = 0.0
    prior_sigma: float | None = None
    drift: float = 0.0


def _mean(limits: ParameterBounds) -> Any:
    return within(Bounds(-limits.value, limits.value))


_MEAN = of_file(
    "Prior mean; for a parameter that is not estimated, the known value, which is subtracted "
    "from the measurements",
    "of the parameter",
)
_SIGMA = of_file("Prior standard deviation", "of the parameter", "default of the parameter")
_DRIFT = of_file("Random walk: standard deviation after one second", "of the parameter / √s")


class RangeOffset(BiasParameter):
    """Offset of range, m."""

    prior: Annotated[float, _mean(bounds.RANGE_OFFSET_M), _MEAN] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.RANGE_OFFSET_M.sigma), _SIGMA] = None
    drift: Annotated[float, Field(ge=0.0, le=bounds.RANGE_OFFSET_M.drift), _DRIFT] = 0.0


class AzimuthOffset(BiasParameter):
    """Offset of azimuth, degrees."""

    prior: Annotated[float, _mean(bounds.AZIMUTH_OFFSET_DEG), _MEAN] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.AZIMUTH_OFFSET_DEG.sigma), _SIGMA] = None
    drift: Annotated[float, Field(ge=0.0, le=bounds.AZIMUTH_OFFSET_DEG.drift), _DRIFT] = 0.0


class RangeGain(BiasParameter):
    """Relative error of range."""

    prior: Annotated[float, _mean(bounds.RANGE_GAIN), _MEAN] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.RANGE_GAIN.sigma), _SIGMA] = None
    drift: Annotated[float, Field(ge=0.0, le=bounds.RANGE_GAIN.drift), _DRIFT] = 0.0


class TimeOffset(BiasParameter):
    """Offset of the time stamps, s."""

    prior: Annotated[float, _mean(bounds.TIME_OFFSET_S), _MEAN] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.TIME_OFFSET_S.sigma), _SIGMA] = None
    drift: Annotated[float, Field(ge=0.0, le=bounds.TIME_OFFSET_S.drift), _DRIFT] = 0.0


class AzimuthWave(BiasParameter):
    """Eccentricity of the antenna: multiple of the sine or cosine of the azimuth, degrees."""

    prior: Annotated[float, _mean(bounds.AZIMUTH_SINE_DEG), _MEAN] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.AZIMUTH_SINE_DEG.sigma), _SIGMA] = None
    drift: Annotated[float, Field(ge=0.0, le=bounds.AZIMUTH_SINE_DEG.drift), _DRIFT] = 0.0


class FrameShift(BiasParameter):
    """Displacement of a local frame, or of the site of a radar, m."""

    prior: Annotated[float, _mean(bounds.FRAME_EAST_M), _MEAN] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.FRAME_EAST_M.sigma), _SIGMA] = None
    drift: Annotated[float, Field(ge=0.0, le=bounds.FRAME_EAST_M.drift), _DRIFT] = 0.0


class FrameRotation(BiasParameter):
    """Rotation of a local frame about its reference point, clockwise, degrees."""

    prior: Annotated[float, _mean(bounds.FRAME_ROTATION_DEG), _MEAN] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.FRAME_ROTATION_DEG.sigma), _SIGMA] = None
    drift: Annotated[float, Field(ge=0.0, le=bounds.FRAME_ROTATION_DEG.drift), _DRIFT] = 0.0


class SensorBias(Table):
    """The bias parameters of a sensor."""

    range_offset_m: Annotated[RangeOffset, of_file("Range offset", "m")] = RangeOffset()
    azimuth_offset_deg: Annotated[AzimuthOffset, of_file("Azimuth offset", "degree")] = (
        AzimuthOffset()
    )
    range_gain: Annotated[RangeGain, of_file("Relative range error", "1")] = RangeGain()
    time_offset_s: Annotated[TimeOffset, of_file("Time stamp offset", "s")] = TimeOffset()
    azimuth_sine_deg: Annotated[
        AzimuthWave,
        of_file("Antenna eccentricity: coefficient of the sine of the azimuth", "degree"),
    ] = AzimuthWave()
    azimuth_cosine_deg: Annotated[
        AzimuthWave,
        of_file("Antenna eccentricity: coefficient of the cosine of the azimuth", "degree"),
    ] = AzimuthWave()
    frame_east_m: Annotated[
        FrameShift,
        of_file("Eastward displacement of the local frame, or of the site of a radar", "m"),
    ] = FrameShift()
    frame_north_m: Annotated[FrameShift, of_file("Northward displacement", "m")] = FrameShift()
    frame_rotation_deg: Annotated[
        FrameRotation,
        of_file("Rotation of the local frame about its reference point, clockwise", "degree"),
    ] = FrameRotation()
