"""Comparison with other software."""
