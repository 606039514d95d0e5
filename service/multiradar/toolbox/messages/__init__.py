"""What a function says while it runs: progress and warnings."""
