"""Decoding of records to target reports, service messages, system tracks and sensor status."""
