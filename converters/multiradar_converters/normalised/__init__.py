"""Measurements in the project's own forms: JSON, NDJSON and Arrow bodies in, a table out."""
