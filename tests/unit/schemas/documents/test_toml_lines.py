"""Lines of keys in TOML, also with multi-line values that contain text resembling a key."""

import tomllib

import pytest

from multiradar_schemas.documents.toml_lines import key_lines, line_of

TEXT = '''title = "a [b] = c"  # [not] = "a table"
"quoted key" = 1
listed = [
    "one = 1",  # ]
    [2, 3],
]
text = """
inside = 1
[sensor]
"""
inline = { a = 1, b = { c = 2 } }
dotted.key.of = 3

[plane]
kind = 'flat'

[[sensor]]
id = "a"
[sensor.bias.range_gain]
prior = 1
[[sensor.leg]]
x = 1
[[sensor.leg]]
x = 2

[[ sensor ]]  # the second
id = "b"
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 1),
        (("quoted key",), 2),
        (("listed", 1, 0), 3),
        (("text",), 7),
        (("inline", "b", "c"), 11),
        (("dotted", "key", "of"), 12),
        (("plane", "kind"), 15),
        (("plane", "absent"), 14),
        (("sensor", 0), 17),
        (("sensor", 0, "id"), 18),
        (("sensor", 0, "bias", "range_gain", "prior"), 20),
        (("sensor", 0, "leg", 1, "x"), 24),
        (("sensor", 1, "id"), 27),
        (("sensor", 1, "latitude_deg"), 26),
        (("sensor", 2), 17),
        (("sensor",), 17),
        (("absent",), None),
        ((), None),
    ],
)
def test_a_key_has_its_line_or_that_of_the_table_that_lacks_it(
    path: tuple[int | str, ...], line: int | None
) -> None:
    assert line_of(path, key_lines(TEXT)) == line


def test_every_key_of_a_text_is_found() -> None:
    def paths(value: object, path: tuple[int | str, ...]) -> list[tuple[int | str, ...]]:
        if isinstance(value, dict):
            return [found for key, one in value.items() for found in paths(one, (*path, key))]
        if isinstance(value, list):
            return [found for at, one in enumerate(value) for found in paths(one, (*path, at))]
        return [path]

    lines = key_lines(TEXT)
    assert all(line_of(path, lines) is not None for path in paths(tomllib.loads(TEXT), ()))
    assert not {("inside",), ("one",), ("not",)} & set(lines)
