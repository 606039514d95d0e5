"""Parameters of bundles."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError
from multiradar.restoration.control_tracks import _layout as layout

Floats = NDArray[np.float64]

#: Names of the kinds of control segments, by number.
KIND_NAMES = ("straight", "right", "left", "faster", "slower")
#: Probabilities of the kind after straight flight, and after any other kind: straight flight, and
#: each of the three others.
_AFTER_STRAIGHT = (0.35, 0.35, 0.15, 0.15)
_BACK_TO_STRAIGHT, _TO_ANOTHER = 0.7, 0.1


@dataclass(frozen=True, slots=True)
class BundleSettings:
    """Parameters of a bundle; accelerations are those of (2.1).

    Attributes
    ----------
    tracks_max : int
        Maximum number of tracks kept after each plot.
    window_s : float
        Length of the window; older plots are absorbed in the prior at its start.
    initial_s : float
        Length of the initial window.
    lateral_max_mps2, longitudinal_max_mps2 : float
        Limits of the accelerations.
    beyond_factor : float
        Factor of the limits if no track within them follows the plots; 1 enforces the limits.
    straight_sigma_mps2 : float
        Standard deviation of both accelerations in straight flight, and of the longitudinal one in
        turns and the lateral one in changes of speed.
    turn_mps2, turn_sigma_mps2 : float
        Prior lateral acceleration of turns: mean and standard deviation.
    speeding_mps2, speeding_sigma_mps2 : float
        Prior longitudinal acceleration of changes of speed: mean and standard deviation.
    straight_s, manoeuvre_s : float
        Mean duration of straight flight, and of a turn or change of speed.
    cell_s : float
        Cell of time in which each kind of motion may start once; the start is estimated within the
        cell and somewhat beyond.
    segment_min_s : float
        Minimum duration of a segment.
    velocity_density : float
        Spectral density of the acceleration, m²/s³, that widens the prior at the start of the
        window: flights do not consist of exact segments.
    ahead_s : float
        Tracks are compared over the window and this time beyond the last plot.
    apart_m : float
        Mean distance below which tracks are merged.
    apart_sigmas : float
        The same in units of the sigma of a position from all plots of the window.
    branch_weight : float
        Minimum weight relative to the best track for branching.
    outlier_probability, outlier_extent_m : float
        Probability of an outlier, and the side of the square over which it is uniform.
    rounds : int
        Iterations of the fit of each track per plot.

    Raises
    ------
    ConfigurationError
        If one of them is out of its range.

    References
    ----------
    IMM UrO RAN report (2016), section 2.5, for the limits of the accelerations; the project's own.
    """

    tracks_max: int = 16
    window_s: float = 90.0
    initial_s: float = 30.0
    lateral_max_mps2: float = 4.0
    longitudinal_max_mps2: float = 2.0
    beyond_factor: float = 2.0
    straight_sigma_mps2: float = 0.01
    turn_mps2: float = 3.0
    turn_sigma_mps2: float = 1.2
    speeding_mps2: float = 0.45
    speeding_sigma_mps2: float = 0.25
    straight_s: float = 26.0
    manoeuvre_s: float = 40.0
    cell_s: float = 8.0
    segment_min_s: float = 3.0
    velocity_density: float = 0.003
    ahead_s: float = 30.0
    apart_m: float = 3.0
    apart_sigmas: float = 0.4
    branch_weight: float = 0.01
    outlier_probability: float = 0.02
    outlier_extent_m: float = 6000.0
    rounds: int = 2

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not (value > 0.0 and np.isfinite(value)):
                raise ConfigurationError(f"{name}: expected a number above 0, was {value}")
        if self.beyond_factor < 1.0:
            raise ConfigurationError(
                f"beyond_factor: expected at least 1, was {self.beyond_factor:g}"
            )
        bounds = (
            ("tracks_max", self.tracks_max, layout.TRACKS_MAX),
            ("window_s", self.window_s, 600.0),
            ("ahead_s", self.ahead_s, 120.0),
            ("initial_s", self.initial_s, self.window_s),
            ("rounds", self.rounds, 50),
            ("outlier_probability", self.outlier_probability, 0.5),
        )
        for name, value, most in bounds:
            if value > most:
                raise ConfigurationError(f"{name}: expected at most {most:g}, was {value:g}")

    def kinds(self) -> Floats:
        """Return the table of the kinds of motion.

        Returns
        -------
        (KINDS, KIND_COUNT) ndarray
            Columns as in `_layout`.
        """
        still = self.straight_sigma_mps2
        # The change of speed in a turn is small but not zero.
        slight = 3.0 * still
        turn = min(self.turn_mps2, self.lateral_max_mps2)
        speed = min(self.speeding_mps2, self.longitudinal_max_mps2)
        along = self.speeding_sigma_mps2
        across = self.turn_sigma_mps2
        table = np.zeros((layout.KINDS, layout.KIND_COUNT))
        table[layout.STRAIGHT, :4] = 0.0, still, 0.0, still
        table[layout.RIGHT, :4] = turn, across, 0.0, slight
        table[layout.LEFT, :4] = -turn, across, 0.0, slight
        table[layout.FASTER, :4] = 0.0, still, speed, along
        table[layout.SLOWER, :4] = 0.0, still, -speed, along
        table[:, layout.ENDING] = 1.0 / self.manoeuvre_s
        table[layout.STRAIGHT, layout.ENDING] = 1.0 / self.straight_s
        share = np.full((layout.KINDS, layout.KINDS), _TO_ANOTHER)
        share[:, layout.STRAIGHT] = _BACK_TO_STRAIGHT
        share[layout.STRAIGHT] = (1.0, *_AFTER_STRAIGHT)
        table[:, layout.FOLLOWING :] = np.log(share)
        return table

    def rules(self) -> Floats:
        """Return the parameters as an array for kernels.

        Returns
        -------
        (RULE_COUNT,) ndarray
            Order as in `_layout`.

        References
        ----------
        The project's own: Gaussians of this sigma, one in the middle of each cell, add up to nearly
        the density of a constant rate.
        """
        rules = np.empty(layout.RULE_COUNT)
        rules[layout.LATERAL_MAX] = self.lateral_max_mps2
        rules[layout.LONGITUDINAL_MAX] = self.longitudinal_max_mps2
        rules[layout.CELL_S] = self.cell_s
        rules[layout.CELL_SIGMA_S] = self.cell_s / np.sqrt(2.0 * np.pi)
        rules[layout.SEGMENT_MIN_S] = self.segment_min_s
        rules[layout.VELOCITY_DRIFT] = self.velocity_density
        rules[layout.WINDOW_S] = self.window_s
        rules[layout.APART_M] = self.apart_m
        rules[layout.APART_SIGMAS] = self.apart_sigmas
        rules[layout.BRANCH_WEIGHT] = self.branch_weight
        rules[layout.LATERAL_BEYOND] = self.beyond_factor * self.lateral_max_mps2
        rules[layout.LONGITUDINAL_BEYOND] = self.beyond_factor * self.longitudinal_max_mps2
        return rules

    def floor(self, determinant_m4: Floats) -> Floats:
        """Return the logarithm of the density of outliers over the maximum density of good plots.

        Parameters
        ----------
        determinant_m4 : (...) ndarray
            Determinants of the covariances of the plots.

        Returns
        -------
        (...) ndarray
            The logarithm, negative for informative plots.

        References
        ----------
        The project's own: a plot is good, or uniform within a square.
        """
        wrong = self.outlier_probability / self.outlier_extent_m**2
        good = (1.0 - self.outlier_probability) / (2.0 * np.pi * np.sqrt(determinant_m4))
        return np.asarray(np.log(wrong / good))
