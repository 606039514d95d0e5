"""Joint estimation of radar biases and tracks."""
