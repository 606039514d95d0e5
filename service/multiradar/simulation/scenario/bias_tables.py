"""Bias tables of a sensor in a scenario: keys, units and bounds."""

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, model_validator

from multiradar.estimation.measurement.sensors import PARAMETER_NAMES
from multiradar_schemas import bounds as bounds
from multiradar_schemas.bounds import Bounds, ParameterBounds
from multiradar_schemas.documents.tables import Table, wrong
from multiradar_schemas.sensors.bias import within

#: Maximum time of a jump: the duration of the longest scenario, s.
JUMP_MAX_S = 7 * 86_400.0


class BiasTable(Table):
    """One bias parameter; a bare number is its value. Subclasses define the bounds."""

    value: float = 0.0
    drift: float = 0.0
    jump: float = 0.0
    jump_s: Annotated[float | None, within(Bounds(0.0, JUMP_MAX_S))] = None
    estimate: bool | None = None
    prior: float = 0.0
    prior_sigma: float | None = None
    assumed_drift: float | None = None

    @model_validator(mode="after")
    def _jump_has_a_time(self) -> Self:
        if self.jump != 0.0 and self.jump_s is None:
            raise wrong(f"missing jump_s, the time at which the bias jumps by {self.jump:g}")
        return self


def _mean(limits: ParameterBounds) -> Any:
    return within(Bounds(-limits.value, limits.value))


def _drift(limits: ParameterBounds) -> Any:
    return within(Bounds(0.0, limits.drift))


class RangeOffsetTable(BiasTable):
    """Offset of range, m."""

    value: Annotated[float, _mean(bounds.RANGE_OFFSET_M)] = 0.0
    drift: Annotated[float, _drift(bounds.RANGE_OFFSET_M)] = 0.0
    jump: Annotated[float, _mean(bounds.RANGE_OFFSET_M)] = 0.0
    prior: Annotated[float, _mean(bounds.RANGE_OFFSET_M)] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.RANGE_OFFSET_M.sigma)] = None
    assumed_drift: Annotated[float | None, _drift(bounds.RANGE_OFFSET_M)] = None


class AzimuthOffsetTable(BiasTable):
    """Offset of azimuth, degrees."""

    value: Annotated[float, _mean(bounds.AZIMUTH_OFFSET_DEG)] = 0.0
    drift: Annotated[float, _drift(bounds.AZIMUTH_OFFSET_DEG)] = 0.0
    jump: Annotated[float, _mean(bounds.AZIMUTH_OFFSET_DEG)] = 0.0
    prior: Annotated[float, _mean(bounds.AZIMUTH_OFFSET_DEG)] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.AZIMUTH_OFFSET_DEG.sigma)] = None
    assumed_drift: Annotated[float | None, _drift(bounds.AZIMUTH_OFFSET_DEG)] = None


class RangeGainTable(BiasTable):
    """Relative error of range."""

    value: Annotated[float, _mean(bounds.RANGE_GAIN)] = 0.0
    drift: Annotated[float, _drift(bounds.RANGE_GAIN)] = 0.0
    jump: Annotated[float, _mean(bounds.RANGE_GAIN)] = 0.0
    prior: Annotated[float, _mean(bounds.RANGE_GAIN)] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.RANGE_GAIN.sigma)] = None
    assumed_drift: Annotated[float | None, _drift(bounds.RANGE_GAIN)] = None


class TimeOffsetTable(BiasTable):
    """Offset of the time stamps, s."""

    value: Annotated[float, _mean(bounds.TIME_OFFSET_S)] = 0.0
    drift: Annotated[float, _drift(bounds.TIME_OFFSET_S)] = 0.0
    jump: Annotated[float, _mean(bounds.TIME_OFFSET_S)] = 0.0
    prior: Annotated[float, _mean(bounds.TIME_OFFSET_S)] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.TIME_OFFSET_S.sigma)] = None
    assumed_drift: Annotated[float | None, _drift(bounds.TIME_OFFSET_S)] = None


class AzimuthWaveTable(BiasTable):
    """Eccentricity of the antenna, degrees."""

    value: Annotated[float, _mean(bounds.AZIMUTH_SINE_DEG)] = 0.0
    drift: Annotated[float, _drift(bounds.AZIMUTH_SINE_DEG)] = 0.0
    jump: Annotated[float, _mean(bounds.AZIMUTH_SINE_DEG)] = 0.0
    prior: Annotated[float, _mean(bounds.AZIMUTH_SINE_DEG)] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.AZIMUTH_SINE_DEG.sigma)] = None
    assumed_drift: Annotated[float | None, _drift(bounds.AZIMUTH_SINE_DEG)] = None


class FrameShiftTable(BiasTable):
    """Displacement of a local frame, or of the site of a radar, m."""

    value: Annotated[float, _mean(bounds.FRAME_EAST_M)] = 0.0
    drift: Annotated[float, _drift(bounds.FRAME_EAST_M)] = 0.0
    jump: Annotated[float, _mean(bounds.FRAME_EAST_M)] = 0.0
    prior: Annotated[float, _mean(bounds.FRAME_EAST_M)] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.FRAME_EAST_M.sigma)] = None
    assumed_drift: Annotated[float | None, _drift(bounds.FRAME_EAST_M)] = None


class FrameRotationTable(BiasTable):
    """Rotation of a local frame about its reference point, degrees."""

    value: Annotated[float, _mean(bounds.FRAME_ROTATION_DEG)] = 0.0
    drift: Annotated[float, _drift(bounds.FRAME_ROTATION_DEG)] = 0.0
    jump: Annotated[float, _mean(bounds.FRAME_ROTATION_DEG)] = 0.0
    prior: Annotated[float, _mean(bounds.FRAME_ROTATION_DEG)] = 0.0
    prior_sigma: Annotated[float | None, within(bounds.FRAME_ROTATION_DEG.sigma)] = None
    assumed_drift: Annotated[float | None, _drift(bounds.FRAME_ROTATION_DEG)] = None


def _as_table(value: Any) -> Any:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return {"value": value} if is_number else value


_NUMBER_ALONE = BeforeValidator(_as_table)


class BiasesTable(Table):
    """The bias parameters of a sensor, in the order of `PARAMETER_NAMES`."""

    range_offset_m: Annotated[RangeOffsetTable, _NUMBER_ALONE] | None = None
    azimuth_offset_deg: Annotated[AzimuthOffsetTable, _NUMBER_ALONE] | None = None
    range_gain: Annotated[RangeGainTable, _NUMBER_ALONE] | None = None
    time_offset_s: Annotated[TimeOffsetTable, _NUMBER_ALONE] | None = None
    azimuth_sine_deg: Annotated[AzimuthWaveTable, _NUMBER_ALONE] | None = None
    azimuth_cosine_deg: Annotated[AzimuthWaveTable, _NUMBER_ALONE] | None = None
    frame_east_m: Annotated[FrameShiftTable, _NUMBER_ALONE] | None = None
    frame_north_m: Annotated[FrameShiftTable, _NUMBER_ALONE] | None = None
    frame_rotation_deg: Annotated[FrameRotationTable, _NUMBER_ALONE] | None = None

    def names(self) -> tuple[str, ...]:
        """Return the names of the parameters that are specified."""
        return tuple(name for name in PARAMETER_NAMES if getattr(self, name) is not None)


assert tuple(BiasesTable.model_fields) == PARAMETER_NAMES
