"""The filters: pure functions on frozen states, found by name."""
