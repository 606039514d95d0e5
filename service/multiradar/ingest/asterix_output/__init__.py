"""System tracks out: blocks of ASTERIX as datagrams and in files, by a thread of its own."""
