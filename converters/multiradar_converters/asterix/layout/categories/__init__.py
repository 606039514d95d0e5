"""The items of each ASTERIX category and edition in `notation`, one module per category."""
