"""The pool of aircraft actors: order, epochs, shards, recovery and publication."""
