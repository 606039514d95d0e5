"""Feeds of receivers, live and recorded: readsb and dump1090 JSON, BaseStation, mlat-server."""
