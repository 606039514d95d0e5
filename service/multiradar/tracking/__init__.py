"""Tracking: association, identity and lifecycle of tracks."""
