"""Measurements as they enter the tracker: columns, order, duplicates."""
