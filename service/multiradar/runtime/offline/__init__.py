"""Tracking of a recording with the same engine, to tables on disk."""
