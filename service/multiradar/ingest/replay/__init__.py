"""Replay of a recording to a service: over HTTP, over Zenoh, as datagrams."""
