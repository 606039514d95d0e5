"""Zenoh: measurement input, track and bias output, over one session."""
