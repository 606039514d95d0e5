"""Days of archives: short simulated recordings of three radars, with biases that change by day."""

import datetime as dt
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import multiradar as mr

FIRST = dt.datetime(2026, 11, 20, 10, tzinfo=dt.UTC)
DAY_S = 86_400.0
#: Range offsets of the radars without a change, m.
RANGE_OFFSETS_M = {"west": 120.0, "east": -60.0, "north": 30.0}
AZIMUTH_OFFSETS_DEG = {"west": 0.2, "east": -0.1, "north": 0.05}
_SITES_M = {"west": (0.0, -50e3), "east": (0.0, 50e3), "north": (60e3, 0.0)}


def date_of(day: int) -> str:
    return (FIRST + dt.timedelta(days=day)).date().isoformat()


def write_day(
    out: Path, day: int, *, east_m: float = 0.0, seed: int = 0, duration_s: float = 240.0
) -> None:
    """Write a day.

    Parameters
    ----------
    out : Path
        The folder to make.
    day : int
        Its number, from 0 on 2026-11-20.
    east_m : float
        Range offset of the radar `east` in addition to the usual one, m.
    seed : int
        Of the traffic and the noise.
    duration_s : float
        Length of the recording from 10:00 UTC, s.
    """
    scene: dict[str, Any] = {
        "title": f"day {day}",
        "seed": 1000 * seed + day,
        "duration_s": duration_s,
        "start_time_s": FIRST.timestamp() + DAY_S * day,
        "plane": {"latitude_deg": 56.0, "longitude_deg": 60.0},
        "traffic": [
            {
                "count": 12,
                "east_m": [-80e3, 80e3],
                "north_m": [-80e3, 80e3],
                "height_m": [8000, 10_000],
                "speed_mps": [150, 250],
            }
        ],
        "sensor": [
            {
                "id": name,
                "north_m": north_m,
                "east_m": east,
                "rotation_period_s": 5,
                "range_sigma_m": 40,
                "azimuth_sigma_deg": 0.06,
                "bias": {
                    "range_offset_m": RANGE_OFFSETS_M[name] + (east_m if name == "east" else 0.0),
                    "azimuth_offset_deg": AZIMUTH_OFFSETS_DEG[name],
                },
            }
            for name, (north_m, east) in _SITES_M.items()
        ],
    }
    mr.simulate(scene, out=out)


def write_days(folder: Path, east_m: Sequence[float], *, seed: int = 0) -> Path:
    """Write consecutive days, with the change of the radar `east` on each; return their sensors."""
    folder.mkdir(parents=True)
    for day, change_m in enumerate(east_m):
        write_day(folder / date_of(day), day, east_m=change_m, seed=seed)
    sensors = folder.with_name(f"sensors-{folder.name}.toml")
    shutil.copyfile(folder / date_of(0) / "sensors.toml", sensors)
    return sensors
