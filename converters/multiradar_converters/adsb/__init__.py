"""Trajectories of aircraft that others heard by ADS-B: JSON, CSV and readsb traces."""
