"""Control tracks: segments of constant acceleration, their fit to plots and priors."""
