"""Tracking a recording or a stream, and the results."""
