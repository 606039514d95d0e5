"""Bearings: where an aircraft is by triangulation, and tracks that they initiate."""
