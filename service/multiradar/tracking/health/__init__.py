"""The health of each sensor, from the innovations of all aircraft."""
