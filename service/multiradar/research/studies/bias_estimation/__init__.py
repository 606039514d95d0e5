"""Biases of radars estimated with the tracks."""
