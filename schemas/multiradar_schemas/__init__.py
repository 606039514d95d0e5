"""The contracts on the wire and on disk: pydantic models, JSON Schema and Arrow schemas."""
