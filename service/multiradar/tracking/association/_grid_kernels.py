"""Compiled prediction of all tracks to a window, indexed by cells of the plane.

Symbols as in `multiradar.tracking.association._association_kernels`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._ground_kernels import GROUND_SPEED_MAX_MPS, ON_GROUND
from multiradar.estimation.filters._kernels import (
    ACCELERATION_DENSITY,
    CONE_RATIO,
    choose_height,
    manoeuvre_factor,
)
from multiradar.estimation.filters.arrays import Aircraft, Model, Rows
from multiradar.estimation.measurement._kernels import (
    PARAMETER_AZIMUTH_OFFSET,
    bias_column,
    locate_measurement,
)
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.geodesy._kernels import C_NORTH, EE, EN, M_EE, M_NN, NE, NN, PE, PN, UE, UN
from multiradar.geodesy._kernels import HEIGHT as SITE_HEIGHT
from multiradar.tracking.association._pair_term_kernels import height_to_locate
from multiradar.tracking.association.track_grid import SPEED_MAX, VELOCITY_ERROR, TrackGrid
from multiradar.tracking.lifecycle.lifecycle import TENTATIVE, USUAL_SPEED, YOUNG_HITS, Lifecycle
from multiradar.tracking.roster import MISSING, Roster, RowIdentities
from multiradar_compiled.kernels import in_loop, kernel
from multiradar_compiled.lane_kernels import (
    LANES,
    every_lane,
    fused_lanes,
    lane_of,
    larger,
    load_lanes,
    load_row,
    sums_of,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

CELL_M = 4_000.0
# Search radius in standard deviations.
COARSE_SIGMAS = 6.0
# Maximum search radius, m.
REACH_MAX_M = 24_000.0
# Search radius above which tracks are stored in larger cells, m, and the size of these, m.
FAR_M = 3_000.0
FAR_CELL_M = 16_000.0
# The error of the velocity increases from this number of missed scans on, over this number of
# further scans, to this factor.
SEEN_SCANS = 2.0
UNSEEN_SCANS = 3.0
REVERSAL_FACTOR = 2.5
# Bound of positions on the plane, m.
PLACE_MAX_M = 1e8
# Column of `TrackGrid.state`: search radius without the motion since the last plot, m.
NEAR_COLUMN = 5
# Distance of a plot from the track with its address, m, beside both search radii.
ADDRESS_MATCH_M = 3_000.0


@in_loop
def velocity_error(silent: float, period: float, rules: Floats) -> float:
    """Return the standard deviation of a wrong or changed velocity, m/s.

    ``silent`` is the time since the last accepted plot. An aircraft missed for several scans may
    have reversed its course.
    """
    unseen = 0.0
    if period > 0.0:
        unseen = min(max(silent / period - SEEN_SCANS, 0.0) / UNSEEN_SCANS, 1.0)
    drift: float = rules[VELOCITY_ERROR] * (1.0 + unseen * (REVERSAL_FACTOR - 1.0))
    return drift


@in_loop
def bucket_of(east_cell: int, north_cell: int, mask: int) -> int:
    """Return the bucket of a cell."""
    return (((east_cell * 73856093) ^ (north_cell * 19349663)) * 2654435761 >> 8) & mask


@kernel
def fill_grid(
    time: float,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    rules: Floats,
    grid: TrackGrid,
) -> float:
    """Predict all tracks to a time and index them by cell; return the largest search radius."""
    # Filters without sensitivities have biases too.
    sigmas = np.sqrt(np.diag(model.bias_covariance)).reshape(1, model.bias.shape[0])
    bias = model.bias.reshape(1, model.bias.shape[0])
    grid.heads[:] = MISSING
    grid.far_heads[:] = MISSING
    grid.longest[:] = -1.0
    mask = grid.heads.shape[0] - 1
    longest = 0.0
    for k in range(roster.track_id.shape[0] - 1, -1, -1):
        if roster.track_id[k] == MISSING or np.isnan(aircraft.time[k]):
            continue
        dt = time - aircraft.time[k]
        P = aircraft.covariance[k]
        x0, x1, x2, x3, b0, b1 = predicted_parts(k, dt, aircraft, bias, sigmas)
        density = model.options[ACCELERATION_DENSITY] * manoeuvre_factor(
            aircraft.fading_nis[k], model.options
        )
        variance = P[0] + P[4] + 2.0 * dt * (P[2] + P[6]) + dt * dt * (P[7] + P[9])
        variance += 2.0 * density * dt * dt * dt / 3.0 + b0 * b0 + b1 * b1
        # A rejected plot changed the time of the state, but added no information.
        silent = max(time - aircraft.updated[k], life.period[k])
        wide = 4.0 * velocity_error(silent, life.period[k], rules) * silent
        # The search radius is bounded by the maximum speed.
        speed = rules[SPEED_MAX] * (1.0 if aircraft.updates[k] == 1 else 0.4)
        if aircraft.on_ground[k] == ON_GROUND:
            speed = GROUND_SPEED_MAX_MPS
        near = COARSE_SIGMAS * math.sqrt(max(P[0] + P[4] + b0 * b0 + b1 * b1, 0.0))
        most = min(near + speed * silent, REACH_MAX_M)
        reach = min(math.sqrt(COARSE_SIGMAS**2 * max(variance, 0.0) + wide * wide), most)
        if 1 < life.hits[k] <= YOUNG_HITS and life.stage[k] == TENTATIVE:
            # The velocity may be wrong: the aircraft may be anywhere around its last plot.
            drift = (math.hypot(x2, x3) + USUAL_SPEED) * silent
            reach = min(max(reach, near + drift), REACH_MAX_M)
        if not (reach >= 0.0 and abs(x0) + abs(x1) < PLACE_MAX_M):  # NaN fails both.
            continue
        grid.state[k, 0] = x0 + dt * x2
        grid.state[k, 1] = x1 + dt * x3
        grid.state[k, 2] = x2
        grid.state[k, 3] = x3
        grid.state[k, 4] = reach
        grid.state[k, NEAR_COLUMN] = near
        grid.reach[k] = reach
        longest = max(longest, reach)
        far = int(reach > FAR_M)
        grid.longest[far] = max(grid.longest[far], reach)
        grid.cell[k, 0] = int(np.floor(grid.state[k, 0] / CELL_M))
        grid.cell[k, 1] = int(np.floor(grid.state[k, 1] / CELL_M))
        bucket = bucket_of(grid.cell[k, 0], grid.cell[k, 1], mask)
        grid.following[k] = grid.heads[bucket]
        grid.heads[bucket] = k
        if far:
            bucket = bucket_of(
                int(np.floor(grid.state[k, 0] / FAR_CELL_M)),
                int(np.floor(grid.state[k, 1] / FAR_CELL_M)),
                mask,
            )
            grid.far_following[k] = grid.far_heads[bucket]
            grid.far_heads[bucket] = k
    return longest


@in_loop
def predicted_parts(
    k: int, dt: float, aircraft: Aircraft, bias: Floats, sigmas: Floats
) -> tuple[float, float, float, float, float, float]:
    """Return the state of a track, and its errors east and north by the biases dt later.

    ``bias`` and ``sigmas`` are rows, (1, c).
    """
    V = aircraft.sensitivity
    shift0 = every_lane(0.0)
    shift1, shift2, shift3, spread0, spread1 = shift0, shift0, shift0, shift0, shift0
    for c in range(0, V.shape[2], LANES):
        lanes = min(LANES, V.shape[2] - c)
        v0, v1 = load_lanes(V, k, 0, c, lanes), load_lanes(V, k, 1, c, lanes)
        v2, v3 = load_lanes(V, k, 2, c, lanes), load_lanes(V, k, 3, c, lanes)
        of_bias, sigma = load_row(bias, 0, c, lanes), load_row(sigmas, 0, c, lanes)
        shift0 = fused_lanes(v0, of_bias, shift0)
        shift1 = fused_lanes(v1, of_bias, shift1)
        shift2 = fused_lanes(v2, of_bias, shift2)
        shift3 = fused_lanes(v3, of_bias, shift3)
        u0, u1 = fused_lanes(dt, v2, v0), fused_lanes(dt, v3, v1)
        spread0 = fused_lanes(larger(u0, -u0), sigma, spread0)
        spread1 = fused_lanes(larger(u1, -u1), sigma, spread1)
    none = every_lane(0.0)
    sums = sums_of(shift0, shift1, shift2, shift3, spread0, spread1, none, none)
    mean = aircraft.mean
    return (
        mean[k, 0] + lane_of(sums, 0),
        mean[k, 1] + lane_of(sums, 1),
        mean[k, 2] + lane_of(sums, 2),
        mean[k, 3] + lane_of(sums, 3),
        lane_of(sums, 4),
        lane_of(sums, 5),
    )


@in_loop
def locate_approximately(
    plane: Floats, site: Floats, slant: float, azimuth: float, height: float, rise: float
) -> tuple[float, float]:
    """Return the approximate position of a plot, within some hundred metres."""
    radius = 1.0 / site[C_NORTH] + site[SITE_HEIGHT]
    sine = (rise * (2.0 * radius + rise) - slant * slant) / (2.0 * slant * radius)
    across = slant * math.sqrt(max(0.0, 1.0 - sine * sine))
    x, y, z = across * math.sin(azimuth), across * math.cos(azimuth), slant * sine
    east = site[PE] + site[EE] * x + site[NE] * y + site[UE] * z
    north = site[PN] + site[EN] * x + site[NN] * y + site[UN] * z
    # Project to the plane along the normal, which tilts with the distance from the centre.
    return east - height * plane[M_EE] * east, north - height * plane[M_NN] * north


@in_loop
def locate_plot(
    kind: int,
    s: int,
    z0: float,
    z1: float,
    measured_height: float,
    model: Model,
    sigmas: Floats,
) -> tuple[bool, float, float, float]:
    """Return (ok, east, north, reach) of a plot at the published biases; not ok in the cone."""
    site, noise = model.sites[s], model.noises[s]
    b0 = 0.0
    b1 = 0.0
    spread = 0.0
    for c in range(model.starts[s], model.starts[s + 1]):
        j0, j1 = bias_column(kind, model.parameters[c], site, z0, z1, 0.0, 0.0)
        b0 += j0 * model.bias[c]
        b1 += j1 * model.bias[c]
        along = sigmas[c] * math.sqrt(j0 * j0 + j1 * j1)
        if model.parameters[c] == PARAMETER_AZIMUTH_OFFSET and kind == KIND_RADAR:
            along *= z0
        spread += along * along
    height, variance = choose_height(measured_height, np.nan, model.options)
    if kind == KIND_RADAR:
        rise = height - noise[3]
        ground = math.sqrt(max(z0 * z0 - rise * rise, 1.0))
        east, north = locate_approximately(model.plane, site, z0 - b0, z1 - b1, height, rise)
        ok = ground >= model.options[CONE_RATIO] * rise
        spread += noise[0] + z0 * z0 * noise[1] + variance * rise * rise / (ground * ground)
    else:
        ok, east, north = locate_measurement(kind, model.plane, site, z0 - b0, z1 - b1, height)
        spread += 2.0 * noise[2]
    ok = ok and math.isfinite(east) and math.isfinite(north)
    return ok, east, north, min(COARSE_SIGMAS * math.sqrt(spread), REACH_MAX_M)


@kernel
def release_distant(
    first: int,
    last: int,
    window_time: float,
    track_numbers: Integers,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    grid: TrackGrid,
    identities: RowIdentities,
    released: Integers,
) -> int:
    """Release rows that were assigned by address alone to an aircraft far away.

    Two transponders may send one address. Returns the number of rows; ``released`` marks them.
    """
    sigmas = np.sqrt(np.diag(model.bias_covariance))
    count = 0
    for row in range(first, last):
        k = identities.slot[row]
        if k < 0 or track_numbers[row] >= 0 or np.isnan(aircraft.time[k]):
            continue
        kind, s = rows.kind[row], rows.sensor[row]
        z0, z1 = rows.z[row, 0], rows.z[row, 1]
        height = height_to_locate(row, rows, model)
        ok, east, north, reach = locate_plot(kind, s, z0, z1, height, model, sigmas)
        ahead = rows.time[row] - window_time
        d0 = grid.state[k, 0] + ahead * grid.state[k, 2] - east
        d1 = grid.state[k, 1] + ahead * grid.state[k, 3] - north
        near = reach + grid.reach[k] + ADDRESS_MATCH_M
        if ok and d0 * d0 + d1 * d1 > near * near:
            identities.slot[row] = MISSING
            released[row - first] = 1
            count += 1
    return count
