"""The radar biases, shared by all aircraft and published by epochs of data time."""
