"""Feeds of receivers: readsb JSON, BaseStation, mlat-server; ASTERIX over TCP."""
