"""What this region hands over to its neighbours."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.memory.bias_board import bias_rows_frame
from multiradar.runtime.memory.knowledge import Knowledge, States
from multiradar.runtime.memory.regions.board import RegionBoard
from multiradar.runtime.memory.regions.messages import TRIANGLE
from multiradar_schemas.products.handover import BIASES_MAX, TRACKS_MAX

#: A state of the filter at another time than the last update is not that of the update, s.
_SAME_TIME_S = 1e-6


def handover_message(board: RegionBoard, known: Knowledge) -> bytes | None:
    """Return what a region hands over now, JSON of `Handover`; None before any track update.

    Parameters
    ----------
    board : RegionBoard
        Which tracks are near a boundary, and for which of them the region is responsible.
    known : Knowledge
        The live tracks and biases.
    """
    rows, reached_s = board.near()
    if not math.isfinite(reached_s):
        return None
    tracks = known.tracks().to_dicts() if len(rows) else []
    biases = bias_rows_frame(known.latest_biases(), known.sensors)
    wanted = ["sensor_id", "parameter", "time_s", "estimate", "sigma"]
    own = board.areas.own
    return json.dumps({
        "region": own.name,
        "latitude_deg": own.latitude_deg,
        "longitude_deg": own.longitude_deg,
        "time_s": reached_s,
        "heard": board.heard(),
        "tracks": handover_tracks(rows[:TRACKS_MAX], tracks, known.states()),
        "biases": biases.select(wanted).head(BIASES_MAX).to_dicts(),
    }, allow_nan=False).encode()  # fmt: skip


def handover_tracks(
    rows: NDArray[np.void], tracks: Sequence[Mapping[str, Any]], states: States | None
) -> list[dict[str, Any]]:
    """Return own tracks for a message.

    Parameters
    ----------
    rows : (n,) ndarray of `OWN_DTYPE`
        The tracks.
    tracks : sequence of mapping
        The live tracks, rows of `Knowledge.tracks`.
    states : States or None
        States of the filter, for covariances of position and velocity together.
    """
    shown = {one["track_id"]: one for one in tracks}
    whole = {} if states is None else _covariances(states)
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
            "covariance": [float(f"{one:.5g}") for one in (covariance if same else plain)],
            **{name: track[name] for name in _COPIED},
            "responsible": bool(row["responsible"]),
            "since_s": float(row["since_s"]),
            "aircraft": row["aircraft"].decode(),
        })  # fmt: skip
    return found


_COPIED = (
    "height_m", "height_sigma_m", "mode_s_address", "mode_3a", "callsign", "turn_right_probability",
    "turn_left_probability", "speed_change_probability", "state",
)  # fmt: skip


def _covariances(states: States) -> dict[int, tuple[float, list[float]]]:
    tracks, plane = states
    turn = np.zeros((len(tracks), 4, 4))
    local = plane.local_matrix(tracks.mean[:, 0], tracks.mean[:, 1])
    turn[:, :2, :2] = turn[:, 2:, 2:] = local
    true = turn @ tracks.covariance @ turn.transpose(0, 2, 1)
    triangles = true[:, *TRIANGLE].tolist()
    given = zip(tracks.track_id.tolist(), tracks.time_s.tolist(), triangles, strict=True)
    return {track: (time_s, triangle) for track, time_s, triangle in given}
