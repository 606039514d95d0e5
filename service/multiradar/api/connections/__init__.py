"""Connections of clients: what each may do, their number, TLS and the configuration of uvicorn."""
