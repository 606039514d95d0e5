"""Retained data for readers: history, live tracks, biases, sensors, rejects."""
