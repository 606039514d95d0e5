"""Filters that drop cross-covariances: Blom, its macro form, covariance intersection."""
