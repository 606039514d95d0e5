"""The life of a track: initiation, confirmation, merging, termination."""
