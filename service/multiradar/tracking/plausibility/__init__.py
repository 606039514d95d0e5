"""Plausibility of the positions reported by aircraft (ADS-B)."""
