"""Sequential filters, one measurement per epoch, and the theory of their errors."""
