"""Days of recordings tracked one by one, and their biases compared."""
