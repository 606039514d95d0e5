"""The two-stage filter: single aircraft, common biases in information form (exact)."""
