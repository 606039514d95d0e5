"""Columns of the arrays that kernels of the restoration work on, and their sizes."""

#: Control segments of a track at most, and parameters of a track at most: place, speed and heading
#: at the anchor, controls of the first segment, then beginning and controls of each further one.
SEGMENTS_MAX = 6
PARAMETERS_MAX = 6 + 3 * (SEGMENTS_MAX - 1)

#: Tracks of a bundle at most, and those that may be weighed with one plot: branches are added until
#: there is no room. Plots of a window at most: of more than 2.8 a second the oldest leave it early,
#: so that none takes longer than 2 ms. Plots of an initial window at most.
TRACKS_MAX, CANDIDATES_MAX, WINDOW_PLOTS_MAX, INITIAL_PLOTS_MAX = 64, 160, 256, 512

#: Columns of a track. Logarithms of what merged and left tracks have brought it, and of its weight;
#: number of segments; place (east, north), speed and heading at the anchor.
MERGED_WEIGHT, WEIGHT, COUNT, EAST, NORTH, SPEED, HEADING = range(7)
#: Columns of its segments, from `SEGMENTS` on: beginning, controls, kind, expected beginning.
SEGMENTS = 7
BEGIN, LATERAL, LONGITUDINAL, KIND, EXPECTED = range(5)
SEGMENT_COUNT = 5
#: What is known of the first six parameters without the plots of the window: mean, covariance,
#: information, logarithm of the determinant of the information.
PRIOR_MEAN = SEGMENTS + SEGMENTS_MAX * SEGMENT_COUNT
PRIOR_COVARIANCE = PRIOR_MEAN + 6
PRIOR_INFORMATION = PRIOR_COVARIANCE + 36
PRIOR_LOGARITHM = PRIOR_INFORMATION + 36
TRACK_COUNT = PRIOR_LOGARITHM + 1

#: Columns of a plot: time, place, information of the place (1/m²), the logarithm of the density of
#: an outlier over the greatest one of a good plot, covariance of the errors that it shares
#: with other plots (east, east and north, north; m²).
TIME, PLOT_EAST, PLOT_NORTH, EAST_EAST, EAST_NORTH, NORTH_NORTH, FLOOR, SHARED = range(8)
SHARED_COUNT = 3
PLOT_COUNT = SHARED + SHARED_COUNT

#: Kinds of control segments, and columns of their table: means and standard deviations of lateral
#: and longitudinal acceleration, rate at which a segment ends, then the logarithms of the shares of
#: the kinds that follow.
STRAIGHT, RIGHT, LEFT, FASTER, SLOWER = range(5)
KINDS = 5
LATERAL_MEAN, LATERAL_SIGMA, LONGITUDINAL_MEAN, LONGITUDINAL_SIGMA, ENDING, FOLLOWING = range(6)
KIND_COUNT = FOLLOWING + KINDS

#: Rules of the bundle, one number each.
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
