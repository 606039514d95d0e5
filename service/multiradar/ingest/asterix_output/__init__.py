"""System track output: ASTERIX blocks as datagrams and in files, in its own thread."""
