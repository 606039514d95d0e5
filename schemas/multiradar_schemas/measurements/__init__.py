"""Measurements: records and columnar validation."""
