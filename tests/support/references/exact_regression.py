"""Bayesian regression on the powers of time in rational arithmetic: no rounding at all."""

from collections.abc import Sequence
from fractions import Fraction
from math import factorial

import numpy as np
from numpy.typing import NDArray

Row = list[Fraction]


class ExactRegression:
    """What is known of α in X_t = Σ α_k t^k / k!, as Y = Γ⁻¹ and y = Γ⁻¹ α̂, on the floats given.

    Times count from the prior's. It shares nothing with the filter: neither the basis (powers),
    nor the form (normal equations), nor the arithmetic.
    """

    def __init__(self, mean: NDArray[np.float64], covariance: NDArray[np.float64]) -> None:
        self.size = len(mean)
        prior = [[Fraction(value) for value in row] for row in covariance.tolist()]
        unit = [[Fraction(int(i == j)) for j in range(self.size)] for i in range(self.size)]
        self.information = solve(prior, unit)
        self.vector = [
            sum((a * Fraction(m) for a, m in zip(row, mean.tolist(), strict=True)), Fraction(0))
            for row in self.information
        ]

    def observe(self, time_s: float, value: float, variance: float) -> None:
        """X at a time, with noise."""
        self._add(_powers(Fraction(time_s), self.size), value, Fraction(variance))

    def observe_increment(
        self, begin_s: float, end_s: float, value: float, intensity: float
    ) -> None:
        """Take one increment of dη = X dt + √C₂ dw."""
        begin, end = (
            _powers(Fraction(begin_s), self.size + 1),
            _powers(Fraction(end_s), self.size + 1),
        )
        row = [b - a for a, b in zip(begin[1:], end[1:], strict=True)]
        variance = Fraction(intensity) * (Fraction(end_s) - Fraction(begin_s))
        self._add(row, value, variance)

    def watch(self, begin_s: float, end_s: float, intensity: float) -> None:
        """Take all of η over an interval; what it says of the mean is left out."""
        a, b, noise = Fraction(begin_s), Fraction(end_s), Fraction(intensity)
        for i in range(self.size):
            for j in range(self.size):
                area = (b ** (i + j + 1) - a ** (i + j + 1)) / (i + j + 1)
                self.information[i][j] += area / (factorial(i) * factorial(j)) / noise

    def covariance(self, time_s: float) -> NDArray[np.float64]:
        """Covariance of the value and its derivatives at a time."""
        rows = self._taylor(time_s)
        spread = solve(self.information, [list(column) for column in zip(*rows, strict=True)])
        exact = [
            [sum((a * s[j] for a, s in zip(row, spread, strict=True)), Fraction(0))
             for j in range(self.size)]
            for row in rows
        ]  # fmt: skip
        return np.array([[float(value) for value in row] for row in exact])

    def mean(self, time_s: float) -> NDArray[np.float64]:
        """Estimate of the value and its derivatives at a time."""
        found = solve(self.information, [[value] for value in self.vector])
        return np.array([
            float(sum((a * f[0] for a, f in zip(row, found, strict=True)), Fraction(0)))
            for row in self._taylor(time_s)
        ])  # fmt: skip

    def _taylor(self, time_s: float) -> list[Row]:
        powers = _powers(Fraction(time_s), self.size)
        return [[Fraction(0)] * k + powers[: self.size - k] for k in range(self.size)]

    def _add(self, row: Row, value: float, variance: Fraction) -> None:
        for i in range(self.size):
            self.vector[i] += row[i] * Fraction(value) / variance
            for j in range(self.size):
                self.information[i][j] += row[i] * row[j] / variance


def solve(matrix: Sequence[Row], right: Sequence[Row]) -> list[Row]:
    """Solve a positive definite system by elimination; no pivot is zero."""
    rows = [[*left, *given] for left, given in zip(matrix, right, strict=True)]
    size = len(rows)
    for k in range(size):
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for i in range(size):
            if i != k and rows[i][k]:
                rows[i] = [a - rows[i][k] * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [row[size:] for row in rows]


def _powers(time: Fraction, count: int) -> Row:
    return [time**k / factorial(k) for k in range(count)]
