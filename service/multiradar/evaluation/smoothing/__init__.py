"""The smoothed reference: plots of all sensors with biases subtracted, smoothed."""
