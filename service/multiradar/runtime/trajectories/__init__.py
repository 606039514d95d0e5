"""Bundles of trajectories of the tracks of the service, and of a run without service."""
