"""The search for trajectories as the report prints it."""
