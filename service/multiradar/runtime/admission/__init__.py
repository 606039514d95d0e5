"""What may enter the engine, and what became of it."""
