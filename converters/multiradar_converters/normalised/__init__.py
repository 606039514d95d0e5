"""Parsing of normalised measurements: JSON, NDJSON and Arrow bodies in, a table out."""
