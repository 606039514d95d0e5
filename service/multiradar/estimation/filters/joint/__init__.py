"""The joint Kalman filter over all aircraft and all biases."""
