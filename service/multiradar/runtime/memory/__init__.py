"""What is retained for readers: history, live tracks, boards."""
