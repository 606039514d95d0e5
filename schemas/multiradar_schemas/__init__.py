"""Interface definitions on the wire and on disk: pydantic models, JSON Schema, Arrow schemas."""
