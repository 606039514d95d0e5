"""Trajectory bundles of tracks, in the service and offline."""
