"""A sensor compared with the others: the single error that explains its plots."""
