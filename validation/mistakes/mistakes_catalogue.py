"""The mistakes with measurements and sensors files, and what is said of each.

Rows are made with the functions of `mistake.py`; other modules of this folder have further rows.
"""

import polars as pl

from validation.mistakes.mistake import (
    AZIMUTH,
    CONVERT,
    FOOT_M,
    HEIGHT,
    NAUTICAL_MILE_M,
    RADAR,
    RADIANS,
    RANGE,
    SECONDS_PER_DAY,
    SENSORS,
    TIME,
    TRACK,
    Mistake,
    Sample,
    alone,
    anonymous,
    column_times,
    doubled,
    dump,
    exchanged,
    late_and_known,
    moved,
    name_of,
    nameless,
    on_the_ground,
    other_installation,
    other_separator,
    other_sites,
    plots,
    renumbered,
    right,
    settings,
    tables_of,
    text_of,
    write,
)

CATALOGUE: tuple[Mistake, ...] = (
    Mistake("none: the sample as it is", right, status=0),
    Mistake("none: with ADS-B", right, TRACK, status=0),
    Mistake("none: plots without identity", anonymous, status=0),
    # Ranges.
    Mistake(
        "ranges in kilometres", plots(RADAR, range_m=RANGE / 1e3), message=(RADAR, "kilometres")
    ),
    Mistake(
        "ranges in nautical miles",
        plots(RADAR, range_m=RANGE / NAUTICAL_MILE_M),
        message=(RADAR, "nautical miles"),
    ),
    Mistake("ranges in feet", plots(RADAR, range_m=RANGE / FOOT_M), message=(RADAR, "feet")),
    Mistake(
        "ranges in kilometres, plots without identity",
        plots(RADAR, anonymous=True, range_m=RANGE / 1e3),
        message=(RADAR, "kilometres"),
    ),
    Mistake(
        "ranges of all radars in kilometres",
        plots(range_m=RANGE / 1e3),
        message=("kilometres",),
        sensors=SENSORS,
    ),
    Mistake(
        "ranges of the only radar in kilometres, plots without identity",
        alone(plots(anonymous=True, range_m=RANGE / 1e3), RADAR),
        message=(RADAR, "kilometres"),
    ),
    Mistake(
        "ground ranges in place of slant ranges",
        on_the_ground(RADAR),
        message=(RADAR, "ground ranges"),
    ),
    Mistake(
        "a range_max_m in kilometres", settings(RADAR, range_max_m=300), message=("range_max_m",)
    ),
    Mistake(
        "a range_max_m in nautical miles",
        settings(RADAR, range_max_m=162),
        message=("range_max_m",),
    ),
    # Azimuths.
    Mistake(
        "azimuths in radians", plots(RADAR, azimuth_deg=AZIMUTH * RADIANS), message=("radians",)
    ),
    Mistake(
        "azimuths in radians, plots without identity",
        plots(RADAR, anonymous=True, azimuth_deg=AZIMUTH * RADIANS),
        message=(RADAR, "radians"),
    ),
    Mistake(
        "azimuths of the only radar in radians, plots without identity",
        alone(plots(RADAR, anonymous=True, azimuth_deg=AZIMUTH * RADIANS), RADAR),
        message=(RADAR, "radians"),
    ),
    Mistake(
        "azimuths in milliradians",
        plots(RADAR, azimuth_deg=AZIMUTH * RADIANS * 1e3),
        message=(RADAR, "milliradians"),
    ),
    Mistake("azimuths in gradians", plots(RADAR, azimuth_deg=AZIMUTH / 0.9), message=("gradians",)),
    Mistake(
        "azimuths anticlockwise",
        plots(RADAR, azimuth_deg=(360.0 - AZIMUTH) % 360.0),
        message=(RADAR, "anticlockwise"),
    ),
    Mistake(
        "azimuths anticlockwise from east",
        plots(RADAR, azimuth_deg=(450.0 - AZIMUTH) % 360.0),
        message=(RADAR, "anticlockwise"),
    ),
    Mistake(
        "azimuths of the only radar anticlockwise, plots without identity",
        alone(plots(anonymous=True, azimuth_deg=(360.0 - AZIMUTH) % 360.0), RADAR),
        message=(RADAR, "anticlockwise"),
    ),
    Mistake(
        "azimuths off by 90°",
        plots(RADAR, azimuth_deg=(AZIMUTH + 90.0) % 360.0),
        message=(RADAR, "off by +89.8°"),
    ),
    Mistake(
        "azimuths off by 180°, plots without identity",
        plots(RADAR, anonymous=True, azimuth_deg=(AZIMUTH + 180.0) % 360.0),
        message=(RADAR, "off by +179.8°"),
    ),
    Mistake(
        "azimuths from magnetic north (4°)",
        plots(RADAR, azimuth_deg=(AZIMUTH - 4.0) % 360.0),
        message=(RADAR, "magnetic"),
    ),
    Mistake(
        "range and azimuth exchanged",
        plots(RADAR, range_m=AZIMUTH, azimuth_deg=RANGE),
        message=(RADAR, "swapped"),
    ),
    # Sites.
    Mistake(
        "latitude and longitude of a site exchanged",
        settings(
            RADAR,
            latitude_deg=lambda one: 6.0994,
            longitude_deg=lambda one: 46.4247,
        ),
        message=(RADAR, "latitude_deg and longitude_deg", "swapped"),
    ),
    Mistake(
        "longitude of a site negative",
        settings(RADAR, longitude_deg=lambda one: -one["longitude_deg"]),
        message=(RADAR, "longitude_deg", "sign"),
    ),
    Mistake(
        "latitude of a site negative",
        settings(RADAR, latitude_deg=lambda one: -one["latitude_deg"]),
        message=(RADAR, "latitude_deg", "sign"),
    ),
    Mistake(
        "a site off by 5 km",
        settings(RADAR, **moved(3e3, 4e3)),
        message=(RADAR, "site is probably 5"),
    ),
    Mistake(
        "a site off by 5 km, plots without identity",
        settings(RADAR, anonymous=True, **moved(3e3, 4e3)),
        message=(RADAR, "site is probably 5"),
    ),
    Mistake(
        "a site off by 50 km",
        settings(RADAR, **moved(-4e4, 3e4)),
        message=(RADAR, "site is probably 50"),
    ),
    Mistake(
        "sites of two radars exchanged",
        exchanged(RADAR, "35-10"),
        message=(RADAR, "35-10", "site"),
        sensors=(RADAR, "35-10"),
    ),
    Mistake(
        "the height of a site in feet",
        settings(RADAR, height_m=lambda one: one["height_m"] / FOOT_M),
        message=(RADAR, "height_m of its site", "feet"),
    ),
    Mistake(
        "the height of a site in kilometres",
        settings(RADAR, height_m=lambda one: one["height_m"] / 1e3),
        message=(RADAR, "height_m of its site", "kilometres"),
    ),
    Mistake(
        "a site off by 1.1 km",
        settings(RADAR, **moved(1.1e3, 0.0)),
        message=(RADAR, "probably 1.1"),
    ),
    Mistake(
        "a site off by 0.4 km, with ADS-B",
        settings(RADAR, **moved(280.0, 280.0)),
        TRACK,
        message=(RADAR, "its site is probably 0.4", "latitude_deg and longitude_deg"),
    ),
    Mistake(
        "a site off by 0.3 km, without a sensor that shows which",
        settings(RADAR, **moved(300.0, 0.0)),
        message=(RADAR, "its site is probably 0.3"),
    ),
    Mistake(
        "sites of two radars at one place off by 0.5 km",
        settings("41-1", "41-10", **moved(350.0, 350.0)),
        message=("41-1, 41-10: its site is probably",),
        sensors=("41-1", "41-10"),
    ),
    Mistake(
        "ranges 2 % too long",
        plots(RADAR, range_m=RANGE * 1.02),
        message=(RADAR, "its ranges are probably 2.0% too long"),
    ),
    Mistake(
        "a range offset held at 0 by a prior_sigma of 1 m (it is 185 m)",
        settings(RADAR, bias={"range_offset_m": {"prior_sigma": 1.0}}),
        message=(RADAR, "bias.range_offset_m", "increase prior_sigma"),
    ),
    # Heights.
    Mistake(
        "none: heights of a hot day",
        plots(height_m=HEIGHT * 0.93),
        status=0,
    ),
    Mistake(
        "heights in hundreds of metres",
        plots(RADAR, height_m=HEIGHT / 100.0),
        message=(RADAR, "hundreds of metres"),
    ),
    Mistake(
        "heights of the only radar in hundreds of metres",
        alone(plots(height_m=HEIGHT / 100.0), RADAR),
        message=(RADAR, "hundreds of metres"),
    ),
    Mistake("heights in feet", plots(RADAR, height_m=HEIGHT / FOOT_M), message=(RADAR, "feet")),
    Mistake(
        "heights in flight levels",
        plots(RADAR, height_m=HEIGHT / FOOT_M / 100.0),
        message=(RADAR, "flight levels"),
    ),
    # Times.
    Mistake(
        "a clock off by 3 s", plots(RADAR, time_s=TIME + 3.0), message=(RADAR, "clock", "s ahead")
    ),
    Mistake(
        "none: a clock off by 3 s, with bias.time_offset_s of 3 s",
        late_and_known(RADAR, 3.0),
        status=0,
    ),
    Mistake("a clock off by 1 h", plots(RADAR, time_s=TIME + 3600.0), message=(RADAR, "1 h")),
    Mistake(
        "times of one radar of another day",
        plots(RADAR, time_s=TIME + SECONDS_PER_DAY),
        message=(RADAR, "2018-08-02"),
    ),
    Mistake(
        "times of one radar without their date",
        plots(RADAR, time_s=TIME % SECONDS_PER_DAY),
        message=(RADAR, "date"),
    ),
    # Names.
    Mistake(
        "a wrong source number",
        renumbered("35-10", 34),
        message=("35-10", "34-10", "sensors.toml"),
        sensors=("35-10",),
    ),
    Mistake(
        "two wrong source numbers",
        lambda sample, folder: settings(RADAR, source=27)(
            Sample(
                sample.dump,
                sample.measurements,
                text_of(
                    [
                        {**table, "source": 36} if name_of(table) == "35-10" else table
                        for table in tables_of(sample)
                    ]
                ),
            ),
            folder,
        ),
        message=("26-10", "27-10", "35-10", "36-10"),
        sensors=(RADAR, "35-10"),
    ),
    Mistake(
        "a radar under the id of the ADS-B source",
        lambda sample, folder: write(
            folder,
            sample.measurements,
            text_of(
                [
                    {
                        **{
                            key: one
                            for key, one in table.items()
                            if key not in ("source", "sensor")
                        },
                        "id": "adsb",
                    }
                    for table in tables_of(sample)
                    if name_of(table) == RADAR
                ]
                + [table for table in tables_of(sample) if name_of(table) not in (RADAR, "adsb")]
            ),
        ),
        TRACK,
        message=("adsb: the sensors file declares a radar under this id",),
        sensors=("adsb",),
    ),
    Mistake("sensors of another recording", other_installation, message=("another",)),
    Mistake(
        "the right numbers, the sites of another country",
        other_sites,
        message=("site",),
        sensors=SENSORS,
    ),
    Mistake(
        "a sensor that sent nothing",
        lambda sample, folder: write(
            folder,
            sample.measurements.filter(pl.col("sensor_id") != "41-1"),
            sample.sensors,
        ),
        message=("41-1", "no measurements"),
        sensors=("41-1",),
    ),
    Mistake(
        "one track number for all aircraft of a radar",
        plots(RADAR, track_number=pl.lit(7)),
        message=(RADAR, "track_number", "the same for all"),
    ),
    Mistake(
        "one Mode S address for all aircraft of a radar, without track numbers",
        nameless(mode_s_address="4B1805"),
        message=(RADAR, "mode_s_address", "the same for all"),
    ),
    Mistake(
        "Mode 3/A code 7000 for all aircraft of a radar, without track numbers",
        nameless(mode_3a="7000"),
        message=("26-10: mode_3a is probably a placeholder", "most of them above FL195"),
    ),
    # Biases.
    Mistake(
        "a range offset fixed at 1000 m (it is 185 m)",
        settings(RADAR, bias={"range_offset_m": {"prior": 1000.0, "estimate": False}}),
        message=(RADAR, "bias.range_offset_m", "estimate = false"),
    ),
    Mistake(
        "an azimuth offset with a wrong prior and its prior_sigma 100 times too small",
        settings(RADAR, bias={"azimuth_offset_deg": {"prior": 0.3, "prior_sigma": 0.005}}),
        message=(RADAR, "bias.azimuth_offset_deg", "prior_sigma"),
    ),
    Mistake(
        "none: both offsets fixed at about the right values",
        settings(
            RADAR,
            bias={
                "range_offset_m": {"prior": 150.0, "estimate": False},
                "azimuth_offset_deg": {"prior": -0.15, "estimate": False},
            },
        ),
        status=0,
    ),
    # Noise and scan periods.
    Mistake(
        "range_sigma_m 100 times too large",
        settings(RADAR, range_sigma_m=4000),
        message=(RADAR, "range_sigma_m"),
    ),
    Mistake(
        "azimuth_sigma_deg 100 times too large",
        settings(RADAR, azimuth_sigma_deg=6.0),
        message=(RADAR, "azimuth_sigma_deg"),
    ),
    Mistake(
        "range_sigma_m 10 times too large",
        settings(RADAR, range_sigma_m=400),
        message=(RADAR, "range_sigma_m"),
    ),
    Mistake(
        "both sigmas 10 times too large",
        settings(RADAR, range_sigma_m=400, azimuth_sigma_deg=0.6),
        message=(RADAR, "range_sigma_m and azimuth_sigma_deg are probably too large"),
    ),
    Mistake(
        "range_sigma_m 100 times too small",
        settings(RADAR, range_sigma_m=0.4),
        message=(RADAR, "range_sigma_m"),
    ),
    Mistake(
        "azimuth_sigma_deg in radians",
        settings(RADAR, azimuth_sigma_deg=0.00105),
        message=(RADAR, "azimuth_sigma_deg"),
    ),
    Mistake(
        "azimuth_sigma_deg in milliradians",
        settings(RADAR, azimuth_sigma_deg=1.05),
        message=(RADAR, "azimuth_sigma_deg"),
    ),
    Mistake(
        "rotation_period_s 12 in place of 4",
        settings("35-10", rotation_period_s=12.0),
        message=("35-10", "rotation_period_s"),
        sensors=("35-10",),
    ),
    Mistake(
        "rotation_period_s in revolutions a minute",
        settings("35-10", rotation_period_s=15.0),
        message=("35-10", "rotation_period_s"),
        sensors=("35-10",),
    ),
    # Kinds, copies.
    Mistake(
        "a radar declared adsb",
        lambda sample, folder: write(
            folder,
            sample.measurements,
            text_of(
                [
                    {"id": RADAR, "kind": "adsb"} if name_of(table) == RADAR else table
                    for table in tables_of(sample)
                ]
            ),
        ),
        message=(RADAR, "kind"),
    ),
    Mistake("the plots of a radar twice", doubled(RADAR), message=(RADAR, "twice")),
    # Dumps.
    Mistake("none: the dump converted", dump(), CONVERT, status=0),
    Mistake(
        "convert: ranges in kilometres",
        dump(plots=column_times("range", 1e-3)),
        CONVERT,
        message=("kilometres",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: azimuths in radians",
        dump(plots=column_times("azimuth", RADIANS)),
        CONVERT,
        message=("radians",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: azimuths in gradians",
        dump(plots=column_times("azimuth", 1 / 0.9)),
        CONVERT,
        message=("gradians",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: another separator", dump(plots=other_separator), CONVERT, message=("plots.txt",)
    ),
    Mistake(
        "convert: azimuths in mils (6400 to a circle)",
        dump(plots=column_times("azimuth", 6400 / 360)),
        CONVERT,
        message=("26-10: its azimuths are probably in mils (6400 to a circle)",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: azimuths in milliradians",
        dump(plots=column_times("azimuth", RADIANS * 1e3)),
        CONVERT,
        message=("26-10: its azimuths are probably in milliradians",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: plots.txt cut short",
        dump(plots=lambda rows: rows[: len(rows) // 2]),
        CONVERT,
        message=("plots.txt: probably truncated",),
    ),
    Mistake(
        "convert: tracks.txt cut short",
        dump(tracks=lambda rows: rows[: len(rows) // 2]),
        CONVERT,
        message=("tracks.txt: probably truncated",),
    ),
    Mistake(
        "none: a dump without its date",
        dump(),
        ("track", "dump", "--sensors", "sensors.toml", "--kinds", "radar", "--out", "out"),
        status=0,
    ),
)
