"""The filter states of live tracks, with the uncertainty of the biases."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.runtime.engine.shared_biases import SharedBiases
from multiradar.tracking.encounters.climbs import climbs, spread_of_heights
from multiradar.tracking.forecast.state_samples import SAMPLE_EVERY_S, Sampling, drawn
from multiradar.tracking.mode_states import groups_by_columns, mode_states, times
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.pool import AircraftPool


def track_states(
    pool: AircraftPool, slots: NDArray[np.intp], used: FilterDefinition, biases: SharedBiases
) -> TrackStates:
    """Return the states of tracks at the published biases.

    Parameters
    ----------
    pool : AircraftPool
        The pool of tracks.
    slots : (n,) int
        Their slots; initiated tracks only.
    used : FilterDefinition
        The filter.
    biases : SharedBiases
        The published biases.

    Returns
    -------
    TrackStates
        One for each slot, in the same order.
    """
    aircraft = pool.aircraft
    covariance = np.empty((len(slots), 4, 4))
    upper = np.triu_indices(4)
    covariance[:, upper[0], upper[1]] = aircraft.covariance[slots]
    covariance[:, upper[1], upper[0]] = aircraft.covariance[slots]
    mean = aircraft.mean[slots]
    estimate, factor = biases.model.bias, biases.model.factor
    root, groups = None, []
    if used.keeps_sensitivity:
        sensitivity = aircraft.sensitivity[slots]
        groups = list(groups_by_columns(sensitivity))
        mean += sensitivity @ estimate
        root = np.empty_like(sensitivity)
        for some, columns in groups:
            root[some] = times(sensitivity[some][..., columns], factor.T[columns])
        covariance += root @ root.transpose(0, 2, 1)
        # The delay of its transponder is an error of each track alone.
        root = root[:, :, : len(biases.state.estimate)]
    covariance += spread_of_heights(aircraft, slots)
    return TrackStates(
        track_id=pool.roster.track_id[slots],
        time_s=aircraft.time[slots],
        mean=mean,
        covariance=covariance,
        height_m=aircraft.height[slots],
        modes=mode_states(aircraft, slots, estimate, factor, groups) if used.keeps_modes else None,
        shared=root,
        climbs=climbs(aircraft, slots),
    )


def sampled(
    pool: AircraftPool, confirmed: NDArray[np.bool_], epoch: int, end_s: float, sampling: Sampling
) -> NDArray[np.intp]:
    """Return the slots of the tracks of a sample, by ascending identifier.

    Parameters
    ----------
    pool : AircraftPool
        The pool of tracks.
    confirmed : (s,) bool
        Whether the track in each slot in use is confirmed.
    epoch : int
        Number of the epoch.
    end_s : float
        Data time of its end, s.
    sampling : Sampling
        All tracks, or randomly drawn ones.

    Returns
    -------
    (n,) int
        Confirmed tracks updated since the previous sample.
    """
    slots = pool.used()
    slots = slots[confirmed & (pool.aircraft.time[slots] >= end_s - SAMPLE_EVERY_S)]
    number = pool.roster.track_id[slots]
    order = drawn(number, epoch) if sampling is Sampling.DRAWN else np.argsort(number)
    chosen: NDArray[np.intp] = slots[order]
    return chosen
