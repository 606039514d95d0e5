"""ADS-B trajectories from receivers and networks: JSON, CSV and readsb traces."""
