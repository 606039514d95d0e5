"""Terminal output of commands, and how they stop."""
