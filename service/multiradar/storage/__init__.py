"""What survives a crash: the journal."""
