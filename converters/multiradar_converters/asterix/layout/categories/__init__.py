"""The items of each ASTERIX category and edition, one module a category, in `notation`."""
