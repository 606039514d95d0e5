"""Triangulation of bearings, and track initiation by bearings."""
