"""An extended Kalman filter of one aircraft in space."""
