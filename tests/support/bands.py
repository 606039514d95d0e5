"""Bands for statistical tests on fixed seeds: correct code fails once in a thousand."""

#: Probability that any check of a test fails for correct code.
FAILURE = 1e-3


def tails(checks: int) -> tuple[float, float]:
    """Return the two probability levels of the band for each of this many checks."""
    outside = FAILURE / checks / 2.0
    return outside, 1.0 - outside
