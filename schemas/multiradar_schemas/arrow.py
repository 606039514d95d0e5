"""The batch forms: columns and types of the tables on the wire and on disk."""

import polars as pl

#: `measurements.parquet` and Arrow bodies; the first three columns are never null.
MEASUREMENT_SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "sensor_id": pl.String(),
        "kind": pl.String(),
        "range_m": pl.Float64(),
        "azimuth_deg": pl.Float64(),
        "latitude_deg": pl.Float64(),
        "longitude_deg": pl.Float64(),
        "height_m": pl.Float64(),
        "mode_3a": pl.String(),
        "mode_s_address": pl.String(),
        "track_number": pl.Int64(),
        "callsign": pl.String(),
        "elevation_deg": pl.Float64(),
        "source_latitude_deg": pl.Float64(),
        "source_longitude_deg": pl.Float64(),
        "source_height_m": pl.Float64(),
    }
)

#: What bearings may tell beside their azimuth.
MEASUREMENT_DIRECTIONS = (
    "elevation_deg",
    "source_latitude_deg",
    "source_longitude_deg",
    "source_height_m",
)

#: Columns that recordings of earlier versions may lack.
MEASUREMENT_LATER = ("callsign", *MEASUREMENT_DIRECTIONS)

#: Columns of `MEASUREMENT_SCHEMA` that every row fills.
MEASUREMENT_REQUIRED = ("time_s", "sensor_id", "kind")

#: `tracks.parquet`: one row for each update of a track.
TRACK_SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "track_id": pl.Int64(),
        "track_number": pl.Int64(),
        "mode_s_address": pl.String(),
        "mode_3a": pl.String(),
        "latitude_deg": pl.Float64(),
        "longitude_deg": pl.Float64(),
        "height_m": pl.Float64(),
        "speed_mps": pl.Float64(),
        "heading_deg": pl.Float64(),
        "position_sigma_m": pl.Float64(),
        "state": pl.String(),
        "sequence": pl.Int64(),
        "sensor_id": pl.String(),
        "velocity_sigma_mps": pl.Float64(),
        "turn_right_probability": pl.Float64(),
        "turn_left_probability": pl.Float64(),
        "speed_change_probability": pl.Float64(),
        "vertical_rate_mps": pl.Float64(),
        "height_sigma_m": pl.Float64(),
        "adsb_implausible": pl.Boolean(),
        "callsign": pl.String(),
    }
)

#: `transitions.parquet`: one row for each step in the life of a track.
TRANSITION_SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "track_id": pl.Int64(),
        "transition": pl.String(),
        "reason": pl.String(),
        "into_track_id": pl.Int64(),
        "last_update_s": pl.Float64(),
    }
)

#: `manoeuvre_planes.parquet`: one row for each track and epoch in which it was updated.
MANOEUVRE_PLANE_SCHEMA = pl.Schema(
    {
        "track_id": pl.Int64(),
        "time_s": pl.Float64(),
        "window_s": pl.Float64(),
        "points": pl.Int64(),
        "normal_east": pl.Float64(),
        "normal_north": pl.Float64(),
        "normal_up": pl.Float64(),
        "distance_m": pl.Float64(),
        "origin_latitude_deg": pl.Float64(),
        "origin_longitude_deg": pl.Float64(),
        "tilt_deg": pl.Float64(),
        "normal_sigma_deg": pl.Float64(),
        "statistic": pl.Float64(),
        "degrees_of_freedom": pl.Int64(),
        "p_value": pl.Float64(),
        "is_planar": pl.Boolean(),
        "printed_statistic": pl.Float64(),
        "printed_threshold": pl.Float64(),
        "refused_by_printed_criterion": pl.Boolean(),
        "reason": pl.String(),
    }
)

#: `observability.parquet`: one row for each track and epoch in which it was updated.
OBSERVABILITY_SCHEMA = pl.Schema(
    {
        "track_id": pl.Int64(),
        "time_s": pl.Float64(),
        "window_s": pl.Float64(),
        "ranges": pl.Int64(),
        "bearings": pl.Int64(),
        "places": pl.Int64(),
        "crossing": pl.Float64(),
        "lines_cross": pl.Boolean(),
        "is_observable": pl.Boolean(),
    }
)

#: `encounters.parquet`: one row for each encounter at the end of each epoch.
ENCOUNTER_SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "closest_time_s": pl.Float64(),
        "time_to_closest_s": pl.Float64(),
        "time_sigma_s": pl.Float64(),
        "distance_m": pl.Float64(),
        "distance_sigma_m": pl.Float64(),
        "distance_low_m": pl.Float64(),
        "distance_high_m": pl.Float64(),
        "distance_now_m": pl.Float64(),
        "together": pl.Boolean(),
        "probability": pl.Float64(),
        "vertical_separation_m": pl.Float64(),
        "vertical_sigma_m": pl.Float64(),
        "probability_both": pl.Float64(),
        "first_track_id": pl.Int64(),
        "first_state": pl.String(),
        "first_age_s": pl.Float64(),
        "first_latitude_deg": pl.Float64(),
        "first_longitude_deg": pl.Float64(),
        "first_height_m": pl.Float64(),
        "second_track_id": pl.Int64(),
        "second_state": pl.String(),
        "second_age_s": pl.Float64(),
        "second_latitude_deg": pl.Float64(),
        "second_longitude_deg": pl.Float64(),
        "second_height_m": pl.Float64(),
    }
)

_NUMBERS = pl.List(pl.Float64())

#: `trajectories.parquet`: one row for each epoch and track whose bundle took a plot in it.
TRAJECTORY_SCHEMA = pl.Schema(
    {
        "track_id": pl.Int64(),
        "time_s": pl.Float64(),
        "window_begin_s": pl.Float64(),
        "plots": pl.Int64(),
        "restarts": pl.Int64(),
        "height_m": pl.Float64(),
        "latitude_deg": pl.Float64(),
        "longitude_deg": pl.Float64(),
        "position_sigma_m": pl.Float64(),
        "speed_mps": pl.Float64(),
        "heading_deg": pl.Float64(),
        "velocity_east_mps": pl.Float64(),
        "velocity_north_mps": pl.Float64(),
        "covariance": _NUMBERS,
        "lateral_mps2": pl.Float64(),
        "longitudinal_mps2": pl.Float64(),
        "straight_probability": pl.Float64(),
        "right_probability": pl.Float64(),
        "left_probability": pl.Float64(),
        "faster_probability": pl.Float64(),
        "slower_probability": pl.Float64(),
        "weights": _NUMBERS,
        "segment_trajectory": pl.List(pl.Int64()),
        "segment_begin_s": _NUMBERS,
        "segment_end_s": _NUMBERS,
        "segment_kind": pl.List(pl.String()),
        "segment_lateral_mps2": _NUMBERS,
        "segment_longitudinal_mps2": _NUMBERS,
        "point_time_s": _NUMBERS,
        "best_latitude_deg": _NUMBERS,
        "best_longitude_deg": _NUMBERS,
        "best_position_sigma_m": _NUMBERS,
        "best_speed_mps": _NUMBERS,
        "best_heading_deg": _NUMBERS,
        "weighted_latitude_deg": _NUMBERS,
        "weighted_longitude_deg": _NUMBERS,
        "weighted_position_sigma_m": _NUMBERS,
        "weighted_speed_mps": _NUMBERS,
        "weighted_heading_deg": _NUMBERS,
        "reason": pl.String(),
    }
)

#: `forecasts.parquet`: one row for each track, moment at which it was forecast, and horizon.
FORECAST_SCHEMA = pl.Schema(
    {
        "track_id": pl.Int64(),
        "made_s": pl.Float64(),
        "horizon_s": pl.Float64(),
        "time_s": pl.Float64(),
        "by": pl.String(),
        "motion": pl.String(),
        "probability": pl.Float64(),
        "latitude_deg": pl.Float64(),
        "longitude_deg": pl.Float64(),
        "height_m": pl.Float64(),
        "covariance_east_m2": pl.Float64(),
        "covariance_east_north_m2": pl.Float64(),
        "covariance_north_m2": pl.Float64(),
        "position_sigma_m": pl.Float64(),
        "region_major_m": pl.Float64(),
        "region_minor_m": pl.Float64(),
        "region_azimuth_deg": pl.Float64(),
        "region_factor": pl.Float64(),
        "calibrated": pl.Boolean(),
        "state": pl.String(),
        "age_s": pl.Float64(),
    }
)

#: `biases.parquet`: one row for each sensor, parameter and epoch.
BIAS_SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "sensor_id": pl.String(),
        "parameter": pl.String(),
        "estimate": pl.Float64(),
        "sigma": pl.Float64(),
        "epoch": pl.Int64(),
        "prior_ratio": pl.Float64(),
    }
)

#: `health.parquet`: one row for each radar and epoch.
HEALTH_SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "sensor_id": pl.String(),
        "alarms": pl.String(),
        "detection_probability": pl.Float64(),
        "looks": pl.Float64(),
        "range_sigma_ratio": pl.Float64(),
        "azimuth_sigma_ratio": pl.Float64(),
        "range_trend_m_per_h": pl.Float64(),
        "range_trend_sigma_m_per_h": pl.Float64(),
        "azimuth_trend_deg_per_h": pl.Float64(),
        "azimuth_trend_sigma_deg_per_h": pl.Float64(),
        "site_east_m": pl.Float64(),
        "site_north_m": pl.Float64(),
        "site_sigma_m": pl.Float64(),
        "silence_s": pl.Float64(),
        "tracks_in_cover": pl.Int64(),
        "tracks_heard": pl.Int64(),
        "bias_jumps": pl.Int64(),
        "last_jump_s": pl.Float64(),
        "epoch": pl.Int64(),
    }
)
