"""The tables of the standards are complete and parsed correctly."""

import pytest

from multiradar_converters.asterix.layout.catalogue import layout_of, layouts, layouts_of
from multiradar_converters.asterix.layout.notation import Field, read_layout, replaced
from multiradar_converters.asterix.layout.program import program_of


def test_a_field_is_read_with_its_form_scale_and_unit() -> None:
    text = "120 fixed A:3 -:5 FL:14s*1/4FL OCT:2o B:8*45/1024deg\n-\nRE explicit  # Expansion"
    (profile,) = read_layout(48, ("1.0",), text).profiles
    assert profile[0] is not None
    assert profile[0].parts[0].octets == 4
    assert profile[0].parts[0].fields == (
        Field("A", 0, 3),
        Field("", 3, 5),
        Field("FL", 8, 14, "signed", 1, 4, "FL"),
        Field("OCT", 22, 2, "octal"),
        Field("B", 24, 8, "unsigned", 45, 1024, "deg"),
    )
    assert profile[1] is None
    assert profile[2] is not None
    assert profile[2].title == "Expansion"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("010 fixed SAC:8 SIC:7", "fill whole octets"),
        ("020 extended A:8", "fill whole octets"),
        ("010 fixed SAC", "NAME:BITS"),
        ("010 fixed SAC:8\n    SUB fixed V:8", "missing sub-items of a compound"),
    ],
)
def test_a_table_that_breaks_a_rule_is_rejected(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_layout(48, ("1.0",), text)


def test_a_line_is_replaced_only_where_there_is_one() -> None:
    assert replaced("010 fixed A:8\n020 fixed B:8", "020 fixed C:16") == (
        "010 fixed A:8\n020 fixed C:16"
    )
    whole = "010 compound\n    CS fixed A:8\n020 fixed B:8"
    assert replaced(whole, "    CS fixed A:16") == whole.replace("A:8", "A:16")
    with pytest.raises(ValueError, match="030"):
        replaced("010 fixed A:8", "030 fixed C:16")


def test_every_layout_makes_a_program_and_begins_with_the_source() -> None:
    for layout in layouts():
        program = program_of(layout)
        assert len(set(program.names) - {name for name in program.names if "/-" in name}) + sum(
            "/-" in name for name in program.names
        ) == len(program.nodes)
        assert program.names[program.profiles[0, 0]] == "010"
        for (node, _), field in program.fields.items():
            assert node in program.places
            assert field.bits <= 64


def test_no_edition_of_a_category_is_described_twice() -> None:
    for category in {layout.category for layout in layouts()}:
        editions = [name for layout in layouts_of(category) for name in layout.editions]
        assert len(editions) == len(set(editions))


@pytest.mark.parametrize(
    ("category", "edition"),
    [
        (1, "1.1"),
        (48, "1.15"),
        (48, "1.32"),
        (21, "0.26"),
        (21, "2.1"),
        (10, "0.24"),
        (62, "1.12"),
        (62, "1.17-cs8"),
        (30, "7.0"),
        (30, "5.1-str"),
        (252, "7.0-connection"),
    ],
)
def test_editions_are_found(category: int, edition: str) -> None:
    assert edition in layout_of(category, edition).editions


def test_an_unknown_edition_is_reported() -> None:
    with pytest.raises(KeyError, match=r"048 9\.9"):
        layout_of(48, "9.9")
