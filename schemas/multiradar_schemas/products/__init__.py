"""What the service reports: tracks, biases, health, forecasts, encounters, trajectories."""
