"""The nearest known name, where one is near enough to be meant."""

import pytest

from multiradar_schemas.documents.names import SHOWN_LENGTH_MAX, did_you_mean, nearest, unknown


@pytest.mark.parametrize(
    ("was", "known", "near"),
    [
        ("trakc", ("track", "serve"), "track"),
        ("epochs", ("epoch_s", "motion"), "epoch_s"),
        ("IMM", ("imm", "ci"), "imm"),
        ("two_stage", ("two-stage", "joint"), "two-stage"),
        ("lat", ("latitude_deg", "longitude_deg"), "latitude_deg"),
        ("azimuth_bias_deg", ("azimuth_sine_deg", "azimuth_offset_deg"), "azimuth_offset_deg"),
        ("SSR", ("radar", "adsb", "mlat"), "radar"),
        ("Mode-S", ("radar", "adsb", "mlat"), "radar"),
        ("ssr", ("adsb", "mlat"), None),
        ("l", ("latitude_deg", "longitude_deg"), None),
        ("wobble", ("range_gain", "time_offset_s"), None),
        ("", ("track",), None),
        ("--", ("--track",), None),
        (7, ("track",), None),
        ("track", (), None),
    ],
)
def test_the_nearest_name_is_found_where_there_is_one(
    was: object, known: tuple[str, ...], near: str | None
) -> None:
    assert nearest(was, known) == near
    assert did_you_mean(was, known) == ("" if near is None else f" (did you mean '{near}'?)")


def test_what_is_not_known_is_cut_and_printable() -> None:
    reported = unknown("key", "\x1b[1m" + "x" * 500, ["a"])
    assert reported.isprintable()
    assert len(reported) < SHOWN_LENGTH_MAX + 40
