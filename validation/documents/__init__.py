"""What the documents show: comparison with programs, figures, costs."""
