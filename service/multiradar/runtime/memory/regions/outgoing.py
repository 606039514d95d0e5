"""What this region hands over to its neighbours."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.runtime.memory.bias_board import bias_rows_frame
from multiradar.runtime.memory.knowledge import Knowledge, States
from multiradar.runtime.memory.regions.board import RegionBoard
from multiradar.runtime.memory.regions.messages import TRIANGLE, are_positive_definite
from multiradar.runtime.stream.region_marks import reference
from multiradar_schemas.products.bias import BiasValue
from multiradar_schemas.products.handover import BIASES_MAX, TRACKS_MAX

#: A state of the filter at another time than the last update is not that of the update, s.
_SAME_TIME_S = 1e-6


class Outgoing(NamedTuple):
    """A message to the neighbours.

    Attributes
    ----------
    payload : bytes
        JSON of `Handover`.
    left_out : int
        Number of tracks for which it has no room.
    """

    payload: bytes
    left_out: int


def handover_message(board: RegionBoard, known: Knowledge) -> Outgoing | None:
    """Return what a region hands over now; None before any measurement.

    Parameters
    ----------
    board : RegionBoard
        Which tracks are near a boundary, and for which of them the region is responsible.
    known : Knowledge
        The live tracks and biases.
    """
    rows, reached_s = board.near()
    time_s = _processed_s(known, reached_s)
    if not math.isfinite(time_s):
        return None
    left_out = max(len(rows) - TRACKS_MAX, 0)
    rows = rows[:TRACKS_MAX]
    near = pl.col("track_id").is_in(rows["track_id"].tolist())
    tracks = known.tracks().filter(near).to_dicts() if len(rows) else []
    biases = bias_rows_frame(known.latest_biases(), known.sensors)
    own = board.areas.own
    payload = json.dumps({
        "region": own.name,
        "latitude_deg": own.latitude_deg,
        "longitude_deg": own.longitude_deg,
        "time_s": time_s,
        "heard": board.heard(),
        "tracks": handover_tracks(own.name, rows, tracks, known.states()),
        "biases": biases.select(list(BiasValue.model_fields)).head(BIASES_MAX).to_dicts(),
    }, allow_nan=False).encode()  # fmt: skip
    return Outgoing(payload, left_out)


# A region without tracks has measurements, too: it is neither behind nor silent.
def _processed_s(known: Knowledge, reached_s: float) -> float:
    data_time_s = known.data_time_s
    if data_time_s is None:
        return reached_s
    return max(reached_s, data_time_s - known.tracking.reorder_horizon_s, 0.0)


def handover_tracks(
    region: str, rows: NDArray[np.void], tracks: Sequence[Mapping[str, Any]], states: States | None
) -> list[dict[str, Any]]:
    """Return own tracks for a message.

    Parameters
    ----------
    region : str
        Name of this region.
    rows : (n,) ndarray of `OWN_DTYPE`
        The tracks.
    tracks : sequence of mapping
        The live tracks, rows of `Knowledge.tracks`.
    states : States or None
        States of the filter, for covariances of position and velocity together.
    """
    shown = {one["track_id"]: one for one in tracks}
    whole = {} if states is None else _covariances(states, rows["track_id"])
    found = []
    for row in rows:
        track = shown.get(int(row["track_id"]))
        if track is None:
            continue
        ee, en, nn = row["position_m2"].tolist()
        vv = float(row["velocity_m2ps2"])
        plain = [ee, en, 0.0, 0.0, nn, 0.0, 0.0, vv, 0.0, vv]
        time_s, covariance = whole.get(int(row["track_id"]), (np.nan, plain))
        same = abs(time_s - float(row["time_s"])) < _SAME_TIME_S
        found.append({
            "track_id": int(row["track_id"]),
            "time_s": float(row["time_s"]),
            "latitude_deg": round(float(np.degrees(row["latitude_rad"])), 7),
            "longitude_deg": round(float(np.degrees(row["longitude_rad"])), 7),
            "velocity_east_mps": round(float(row["east_mps"]), 3),
            "velocity_north_mps": round(float(row["north_mps"]), 3),
            "covariance": covariance if same else _rounded(plain),
            **{name: track[name] for name in _COPIED},
            "responsible": bool(row["responsible"]),
            "since_s": float(row["since_s"]),
            "aircraft": (row["aircraft"] or reference(region, int(row["track_id"]))).decode(),
        })  # fmt: skip
    return found


_COPIED = (
    "height_m", "height_sigma_m", "mode_s_address", "mode_3a", "callsign", "turn_right_probability",
    "turn_left_probability", "speed_change_probability", "state",
)  # fmt: skip


# To five digits, which is enough, unless that makes a matrix of long axes indefinite: the whole
# message would be rejected. Of the tracks with these numbers alone: a region has many more.
def _covariances(states: States, wanted: NDArray[np.int64]) -> dict[int, tuple[float, list[float]]]:
    tracks, plane = states
    near = np.flatnonzero(np.isin(tracks.track_id, wanted))
    turn = np.zeros((len(near), 4, 4))
    local = plane.local_matrix(tracks.mean[near, 0], tracks.mean[near, 1])
    turn[:, :2, :2] = turn[:, 2:, 2:] = local
    true = turn @ tracks.covariance[near] @ turn.transpose(0, 2, 1)
    triangles = true[:, *TRIANGLE]
    rounded = np.array([_rounded(one) for one in triangles.tolist()]).reshape(triangles.shape)
    wrong = ~are_positive_definite(rounded)
    rounded[wrong] = triangles[wrong]
    usable = are_positive_definite(rounded)
    numbers, times_s = tracks.track_id[near][usable].tolist(), tracks.time_s[near][usable].tolist()
    given = zip(numbers, times_s, rounded[usable].tolist(), strict=True)
    return {track: (time_s, triangle) for track, time_s, triangle in given}


def _rounded(values: Sequence[float]) -> list[float]:
    return [float(f"{one:.5g}") for one in values]
