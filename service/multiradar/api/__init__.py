"""The REST API, the WebSocket and the event stream."""
