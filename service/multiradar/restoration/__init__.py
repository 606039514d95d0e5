"""Trajectory reconstruction: the path of one aircraft, from its plots over some time."""
