"""The pool on several processes and machines: shards that step partitions of the aircraft."""
