"""Radar biases: common to all aircraft, published once per epoch of data time."""
