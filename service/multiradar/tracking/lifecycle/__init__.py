"""Track lifecycle: initiation, confirmation, merging, termination."""
