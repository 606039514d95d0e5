"""Environment variables of the commands that are not settings."""

#: API key; an option would show it to all users of the machine.
KEY_VARIABLE = "MULTIRADAR_KEY"
#: Set to 1 to see the traceback of an internal error.
TRACEBACK_VARIABLE = "MULTIRADAR_TRACEBACK"
