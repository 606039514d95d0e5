"""A second service that follows the journal of the primary, and takes over when that ends."""
