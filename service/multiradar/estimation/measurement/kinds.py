"""Kinds of measurements, as numbers of the core; `MeasurementBatch.kind` has the first three."""

#: Slant range and azimuth of a radar.
KIND_RADAR = 0
#: A reported position, east and north.
KIND_POSITION = 1
#: An azimuth without a range.
KIND_BEARING = 2
#: Range and azimuth on a flat plane, and the position of such a plot (see `_kernels`).
KIND_FLAT_POLAR = 3
KIND_FLAT_POSITION = 4
#: A bearing with an elevation; `MeasurementBatch.kind` calls both bearings.
KIND_DIRECTION = 5
