"""Joint estimation of aircraft motion and radar biases."""
