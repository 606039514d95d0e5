"""Alignment of radars from a recording: biases from pairs of plots of the same aircraft."""
