"""Interacting multiple models on the two-stage filter."""
