"""Aircraft-derived data of all recordings: registers, units, plausibility, noise."""
