"""Control tracks: segments of constant acceleration, fitted to plots and priors."""
