"""Recordings in, normalised measurements out: no sockets, no clock."""
