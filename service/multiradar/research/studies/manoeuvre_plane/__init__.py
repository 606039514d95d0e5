"""The plane of a manoeuvre."""
