"""Beside other software."""
