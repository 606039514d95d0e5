"""Writes tables as TOML text."""

import json
from collections.abc import Mapping
from typing import Any


def toml_text(table: Mapping[str, Any]) -> str:
    """Return a table as TOML.

    Parameters
    ----------
    table : mapping
        Keys are bare words; values are strings, numbers, booleans, lists of these, tables, and
        lists of tables. None values are left out.

    Returns
    -------
    str
        Text that reads back as the same table.
    """
    return "\n".join(_lines(table, ())).strip() + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    lines: list[str] = []
    inner: list[str] = []
    for key, value in table.items():
        where = (*path, key)
        if isinstance(value, Mapping):
            # A table with only subtables needs no heading of its own.
            lone = bool(value) and all(isinstance(one, Mapping) for one in value.values())
            heading = [] if lone else ["", f"[{'.'.join(where)}]"]
            inner += [*heading, *_lines(value, where)]
        elif _is_tables(value):
            for one in value:
                inner += ["", f"[[{'.'.join(where)}]]", *_lines(one, where)]
        elif value is not None:
            lines.append(f"{key} = {_value(value)}")
    return lines + inner


def _is_tables(value: Any) -> bool:
    is_list = isinstance(value, list | tuple)
    return is_list and len(value) > 0 and all(isinstance(one, Mapping) for one in value)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON escapes are valid TOML, except DEL, which JSON leaves as it is.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(one) for one in value)}]"
    return repr(value)
