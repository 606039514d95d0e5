"""A sensor compared with the others: which single mistake explains its plots."""
