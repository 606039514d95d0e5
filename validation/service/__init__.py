"""Checks of the running service."""
