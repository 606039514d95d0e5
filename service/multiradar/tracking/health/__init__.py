"""Sensor health, from the innovations of all aircraft."""
