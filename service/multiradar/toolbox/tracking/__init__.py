"""Tracking a recording or a stream, and what comes of it."""
