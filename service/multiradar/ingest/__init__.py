"""Live measurements in: HTTP bodies, Zenoh samples, replayed files."""
