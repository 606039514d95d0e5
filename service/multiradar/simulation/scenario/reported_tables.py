"""Tables of a scenario on what aircraft report of their flight: keys, units and bounds."""

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field

from multiradar.simulation.scenario.reported_data import (
    REGISTER_NAMES,
    Atmosphere,
    RegisterName,
    RegisterReports,
)
from multiradar_schemas.documents.tables import Table

_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_KM = 1000.0


def _tuple_of(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


class AtmosphereTable(Table):
    """Wind, temperature and magnetic variation."""

    wind_speed_mps: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    wind_from_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0
    wind_shear_mps_per_km: Annotated[float, Field(ge=-20.0, le=20.0)] = 0.0
    wind_veer_deg_per_km: Annotated[float, Field(ge=-45.0, le=45.0)] = 0.0
    wind_gradient_mps_per_100_km: Annotated[float, Field(ge=-50.0, le=50.0)] = 0.0
    magnetic_variation_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 0.0
    temperature_offset_k: Annotated[float, Field(ge=-60.0, le=60.0)] = 0.0

    def atmosphere(self) -> Atmosphere:
        """Return the atmosphere in SI units and radians."""
        return Atmosphere(
            wind_speed_mps=self.wind_speed_mps,
            wind_from_rad=float(np.radians(self.wind_from_deg)),
            wind_shear_per_s=self.wind_shear_mps_per_km / _KM,
            wind_veer_rad_per_m=float(np.radians(self.wind_veer_deg_per_km)) / _KM,
            wind_gradient_per_s=self.wind_gradient_mps_per_100_km / (100.0 * _KM),
            magnetic_variation_rad=float(np.radians(self.magnetic_variation_deg)),
            temperature_offset_k=self.temperature_offset_k,
        )


class RegistersTable(Table):
    """Registers that a sensor receives."""

    registers: Annotated[
        tuple[RegisterName, ...], BeforeValidator(_tuple_of), Field(min_length=1)
    ] = REGISTER_NAMES
    probability: _Share = 1.0
    noise_scale: Annotated[float, Field(ge=0.0, le=100.0)] = 1.0
    age_max_s: Annotated[float, Field(ge=0.0, le=60.0)] = 1.0
    swap_probability: _Share = 0.0
    stale_share: _Share = 0.0
    sign_share: _Share = 0.0
    stuck_share: _Share = 0.0
    checks: bool = True

    def reports(self) -> RegisterReports:
        """Return the same for the simulation."""
        return RegisterReports(**self.model_dump())
