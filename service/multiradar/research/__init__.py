"""What reproduces the source papers: studies, sequential filters, motion models, their search."""
