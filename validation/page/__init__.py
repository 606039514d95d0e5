"""Numbers of the air picture: frames per second, memory, cost of its readers."""
