"""The two-stage filter: each aircraft by itself, the biases of all by information (exact)."""
