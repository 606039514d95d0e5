"""Tracking with bearings only."""
