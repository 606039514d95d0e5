"""Measurements: the record, and the checks on whole columns of them."""
