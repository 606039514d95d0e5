"""Bands for tests of chance on fixed seeds: so wide that what is right fails one in a thousand."""

#: Probability that one of all checks of a test fails although what it checks is right.
FAILURE = 1e-3


def tails(checks: int) -> tuple[float, float]:
    """Return the two levels between which each of so many checks lies."""
    outside = FAILURE / checks / 2.0
    return outside, 1.0 - outside
