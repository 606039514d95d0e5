"""Alarms of the live service: silence, wrong clocks, floods."""
