"""A service with many moving aircraft, for measurements."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import IO

import httpx
import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.clock import SystemClock
from multiradar.geodesy.polar import slant_range_azimuth

#: Radars: name, latitude and longitude, degrees, height, m.
SITES = {"R1": (50.0, 8.0, 300.0), "R2": (49.0, 11.5, 400.0), "R3": (51.2, 11.0, 200.0)}
PERIOD_S = 4.0
#: Largest distance of an aircraft from the middle of the area, degrees.
HALF_WIDE_DEG = (1.6, 3.0)
_CENTRE_DEG = (50.1, 10.0)
_METRES_PER_DEGREE = 111_200.0
_NOISE_M, _NOISE_RAD = 40.0, 0.0008
CLOCK = SystemClock()
_ARROW = "application/vnd.apache.arrow.stream"
_TIMEOUT_S = 600.0
_PAST_S = 7200.0
_POLL_S = 0.1

Floats = NDArray[np.float64]
_TEXTS = ("sensor_id", "kind", "mode_3a", "mode_s_address", "callsign")


class Sky:
    """Aircraft on straight lines that turn round at the edge of the area.

    Parameters
    ----------
    aircraft : int
        Their number.
    """

    def __init__(self, aircraft: int) -> None:
        random = np.random.Generator(np.random.PCG64(16))
        self._random = random
        self._north = random.uniform(-1.0, 1.0, aircraft) * HALF_WIDE_DEG[0]
        self._east = random.uniform(-1.0, 1.0, aircraft) * HALF_WIDE_DEG[1]
        heading = random.uniform(0.0, 2.0 * np.pi, aircraft)
        speed = random.uniform(150.0, 260.0, aircraft)
        wide = np.cos(np.radians(_CENTRE_DEG[0]))
        self._rates = (
            speed * np.cos(heading) / _METRES_PER_DEGREE,
            speed * np.sin(heading) / _METRES_PER_DEGREE / wide,
        )
        self._height_m = 300.0 * random.integers(10, 40, aircraft).astype(np.float64)
        self._number = np.arange(aircraft)

    def measured(self, from_s: float, to_s: float, origin_s: float) -> pl.DataFrame:
        """Return the measurements of a time, by ascending time.

        Parameters
        ----------
        from_s, to_s : float
            Times since the start, s.
        origin_s : float
            Data time of the start, s.
        """
        parts = [self._of_radar(at, from_s, to_s) for at in range(len(SITES))]
        frame = pl.concat(parts).sort("time_s")
        return frame.with_columns(time_s=pl.col("time_s") + origin_s)

    def _of_radar(self, radar: int, from_s: float, to_s: float) -> pl.DataFrame:
        name, site = list(SITES.items())[radar]
        at = (np.radians(site[0]), np.radians(site[1]), site[2])
        # The antenna meets an aircraft once in a scan, at its azimuth.
        begin = np.floor(from_s / PERIOD_S)
        times, numbers = [], []
        for scan in np.arange(begin - 1.0, np.ceil(to_s / PERIOD_S) + 1.0):
            middle = (scan + 0.5) * PERIOD_S
            latitude, longitude = self._position(np.full(len(self._number), middle), self._number)
            azimuth = slant_range_azimuth(at, latitude, longitude, self._height_m)[1]
            met = (scan + azimuth / (2.0 * np.pi) % 1.0) * PERIOD_S
            seen = (met >= from_s) & (met < to_s)
            times.append(met[seen])
            numbers.append(self._number[seen])
        time_s, number = np.concatenate(times), np.concatenate(numbers)
        latitude, longitude = self._position(time_s, number)
        range_m, azimuth, _ = slant_range_azimuth(at, latitude, longitude, self._height_m[number])
        count = len(number)
        range_m = range_m + self._random.normal(0.0, _NOISE_M, count)
        azimuth = azimuth + self._random.normal(0.0, _NOISE_RAD, count)
        return pl.DataFrame(
            {
                "time_s": time_s,
                "sensor_id": [name] * count,
                "kind": ["radar"] * count,
                "range_m": np.maximum(range_m, self._height_m[number]),
                "azimuth_deg": np.degrees(azimuth) % 360.0,
                "height_m": self._height_m[number],
                "mode_3a": [f"{one % 4096:04o}" for one in number.tolist()],
                "mode_s_address": [f"{one + 0x400000:06x}" for one in number.tolist()],
                "callsign": [f"TST{one}" for one in number.tolist()],
            },
            # Also for the half second in which a radar meets no aircraft.
            schema_overrides=dict.fromkeys(_TEXTS, pl.String),
        )

    def _position(self, time_s: Floats, number: NDArray[np.int64]) -> tuple[Floats, Floats]:
        north = _folded(self._north[number] + self._rates[0][number] * time_s, HALF_WIDE_DEG[0])
        east = _folded(self._east[number] + self._rates[1][number] * time_s, HALF_WIDE_DEG[1])
        return np.radians(_CENTRE_DEG[0] + north), np.radians(_CENTRE_DEG[1] + east)


# Reflected at both ends of the interval from -half to half.
def _folded(values: Floats, half: float) -> Floats:
    return np.abs((values + half) % (4.0 * half) - 2.0 * half) - half


def started(
    folder: Path,
    sensors: str,
    *options: str,
    errors: IO[str] | None = None,
    settings: Mapping[str, str] | None = None,
    module: str = "multiradar",
) -> "subprocess.Popen[str]":
    """Start a service on a free port, with its journal in a folder; it prints its address as JSON.

    Parameters
    ----------
    folder : Path
        For its journal and its configuration.
    sensors : str
        Its `sensors.toml`.
    *options : str
        Further options of `serve`.
    errors : file, optional
        For its standard error; that of this process when absent.
    settings : mapping of str to str, optional
        Further variables of its environment.
    module : str
        The module that is the command.
    """
    path = folder / "sensors.toml"
    path.write_text(sensors, encoding="utf-8")
    command = [
        sys.executable, "-m", module, "serve", "--sensors", str(path), "--port", "0",
        "--no-zenoh", "--json", "--state", str(folder / "state"), "--log-level", "warning",
        *options,
    ]  # fmt: skip
    environment = {**os.environ, **(settings or {})}
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=errors, text=True, env=environment
    )


class Traffic:
    """A service in a process of its own, fed in real time from a thread.

    Parameters
    ----------
    folder : Path
        For its journal and its configuration.
    aircraft : int
        Number of aircraft.
    warm_s : float
        Data time that it has at the start, s.
    settings : mapping of str to str, optional
        Variables of the environment of the service.
    past_s : float, optional
        How far in the past the first measurement is, s.
    """

    def __init__(
        self, folder: Path, aircraft: int, warm_s: float = 24.0,
        settings: Mapping[str, str] | None = None, *, past_s: float = _PAST_S,
    ) -> None:  # fmt: skip
        self.sky = Sky(aircraft)
        self._folder, self._settings = folder, settings
        self._start()
        self._sent_s = 0.0
        # In the past, so that no measurement is from the future.
        self._origin_s = CLOCK.now_s() - past_s
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        for _ in range(round(warm_s / PERIOD_S)):
            self.send(PERIOD_S)

    def __enter__(self) -> "Traffic":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
        self._client.close()
        self._process.terminate()
        self._process.wait()

    def send(self, duration_s: float) -> int:
        """Send the measurements of the next seconds, and return their number."""
        frame = self.sky.measured(self._sent_s, self._sent_s + duration_s, self._origin_s)
        self._sent_s += duration_s
        if len(frame):
            self.post(frame)
        return len(frame)

    def post(self, frame: pl.DataFrame) -> None:
        """Send measurements."""
        content = frame.write_ipc_stream(None).getvalue()
        answer = self._client.post(
            "/v1/measurements", content=content, headers={"content-type": _ARROW}
        )
        answer.raise_for_status()

    def prepared(self, duration_s: float) -> pl.DataFrame:
        """Return the measurements of the next seconds, to be posted later."""
        frame = self.sky.measured(self._sent_s, self._sent_s + duration_s, self._origin_s)
        self._sent_s += duration_s
        return frame

    def flush(self) -> None:
        """Wait until everything is processed."""
        self._client.post("/v1/flush").raise_for_status()

    def live(self, every_s: float = 0.5) -> None:
        """Feed in real time until the end."""
        self._thread = threading.Thread(target=self._feed, args=(every_s,), daemon=True)
        self._thread.start()

    @property
    def data_time_s(self) -> float:
        """The end of what was sent or prepared, data time, s."""
        return self._origin_s + self._sent_s

    @property
    def pid(self) -> int:
        """The process of the service."""
        return self._process.pid

    def restart(self) -> float:
        """Kill the service, start it again on its journal; return the time until it answers, s."""
        began_s = CLOCK.monotonic_s()
        self._client.close()
        self._process.kill()
        self._process.wait()
        self._start()
        while self._client.get("/v1/status").status_code != httpx.codes.OK:
            threading.Event().wait(_POLL_S)
        return CLOCK.monotonic_s() - began_s

    def _start(self) -> None:
        self._process = started(self._folder, sensors_text(), settings=self._settings)
        if self._process.stdout is None:
            raise SystemExit("the service has no output")
        self.url: str = json.loads(self._process.stdout.readline())["http"]
        self._client = httpx.Client(base_url=self.url, timeout=_TIMEOUT_S)

    def processor_s(self) -> float:
        """Return the processor time that the service has used, s."""
        return processor_s(self._process.pid)

    def _feed(self, every_s: float) -> None:
        began_s, before_s = CLOCK.monotonic_s(), self._sent_s
        while not self._ended.wait(every_s):
            due_s = before_s + CLOCK.monotonic_s() - began_s
            if due_s > self._sent_s:
                self.send(due_s - self._sent_s)


def processor_s(pid: int) -> float:
    """Return the processor time that a process has used, s; 0 for one that ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def sensors_text(names: Iterable[str] = tuple(SITES)) -> str:
    """Return the `sensors.toml` of radars."""
    return "\n".join(_sensor_text(name, SITES[name]) for name in names)


def _sensor_text(name: str, site: tuple[float, float, float]) -> str:
    return (
        f'[[sensor]]\nid = "{name}"\nkind = "radar"\nlatitude_deg = {site[0]}\n'
        f"longitude_deg = {site[1]}\nheight_m = {site[2]}\nrange_sigma_m = {_NOISE_M}\n"
        f"azimuth_sigma_deg = {np.degrees(_NOISE_RAD):.4f}\nrotation_period_s = {PERIOD_S}\n"
    )
