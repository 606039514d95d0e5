"""The documents: comparison with program output, figures, costs."""
