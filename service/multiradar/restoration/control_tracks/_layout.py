"""Columns and sizes of the arrays of the restoration kernels."""

#: Maximum number of control segments and of parameters of a track: position, speed and heading at
#: the anchor, controls of the first segment, then start and controls of each further one.
SEGMENTS_MAX = 6
PARAMETERS_MAX = 6 + 3 * (SEGMENTS_MAX - 1)

#: Maxima: tracks of a bundle; candidates per plot, including branches; plots of a window (above 2.8
#: plots per second the oldest leave it early, so that a plot takes at most 2 ms); plots of an
#: initial window.
TRACKS_MAX, CANDIDATES_MAX, WINDOW_PLOTS_MAX, INITIAL_PLOTS_MAX = 64, 160, 256, 512

#: Columns of a track: logarithms of the weight gained from merged tracks and plots that left the
#: window, and of its weight; number of segments; position (east, north), speed and heading at the
#: anchor.
MERGED_WEIGHT, WEIGHT, COUNT, EAST, NORTH, SPEED, HEADING = range(7)
#: Columns of its segments, from `SEGMENTS` on: start, controls, kind, expected start.
SEGMENTS = 7
BEGIN, LATERAL, LONGITUDINAL, KIND, EXPECTED = range(5)
SEGMENT_COUNT = 5
#: Prior of the first six parameters, without the plots of the window: mean, covariance,
#: information, logarithm of the determinant of the information.
PRIOR_MEAN = SEGMENTS + SEGMENTS_MAX * SEGMENT_COUNT
PRIOR_COVARIANCE = PRIOR_MEAN + 6
PRIOR_INFORMATION = PRIOR_COVARIANCE + 36
PRIOR_LOGARITHM = PRIOR_INFORMATION + 36
TRACK_COUNT = PRIOR_LOGARITHM + 1

#: Columns of a plot: time, position, information of the position (1/m²), logarithm of the density
#: of an outlier over the maximum density of a good plot, covariance of the errors common with other
#: plots (east, east and north, north; m²).
TIME, PLOT_EAST, PLOT_NORTH, EAST_EAST, EAST_NORTH, NORTH_NORTH, FLOOR, SHARED = range(8)
SHARED_COUNT = 3
PLOT_COUNT = SHARED + SHARED_COUNT

#: Kinds of control segments, and columns of their table: means and standard deviations of lateral
#: and longitudinal acceleration, rate at which a segment ends, then the logarithms of the
#: probabilities of the next kind.
STRAIGHT, RIGHT, LEFT, FASTER, SLOWER = range(5)
KINDS = 5
LATERAL_MEAN, LATERAL_SIGMA, LONGITUDINAL_MEAN, LONGITUDINAL_SIGMA, ENDING, FOLLOWING = range(6)
KIND_COUNT = FOLLOWING + KINDS

#: Parameters of the bundle, one number each.
(
    LATERAL_MAX,
    LONGITUDINAL_MAX,
    CELL_S,
    CELL_SIGMA_S,
    SEGMENT_MIN_S,
    VELOCITY_DRIFT,
    WINDOW_S,
    APART_M,
    BRANCH_WEIGHT,
    LATERAL_BEYOND,
    LONGITUDINAL_BEYOND,
    APART_SIGMAS,
) = range(12)
RULE_COUNT = 12
