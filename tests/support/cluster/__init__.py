"""Engines on shards, in this process and on Ray."""
