"""Mistakes in the files of a dump for check_mistakes.py: one file contradicts the others.

The rows are made as those of mistakes_catalogue.py; `DUMP_MISTAKES` goes after its `CATALOGUE`.
"""

from collections.abc import Callable

from validation.mistakes.mistake import CONVERT, FOOT_M, SENSORS, Mistake, column_times, dump

Rows = list[list[str]]


def added(column: str, number: int) -> Callable[[Rows], Rows]:
    """Return a function that adds to a column of whole numbers."""

    def edited(rows: Rows) -> Rows:
        index = rows[0].index(column)
        for row in rows[1:]:
            if len(row) == len(rows[0]) and row[index].isdecimal():
                row[index] = str(int(row[index]) + number)
        return rows

    return edited


def exchanged(first: str, second: str) -> Callable[[Rows], Rows]:
    """Return a function that exchanges two columns, but not their names."""

    def edited(rows: Rows) -> Rows:
        one, other = rows[0].index(first), rows[0].index(second)
        for row in rows[1:]:
            if len(row) == len(rows[0]):
                row[one], row[other] = row[other], row[one]
        return rows

    return edited


def of_other_rows(column: str) -> Callable[[Rows], Rows]:
    """Return a function that gives each row a value of the next one."""

    def edited(rows: Rows) -> Rows:
        index = rows[0].index(column)
        whole = [row for row in rows[1:] if len(row) == len(rows[0])]
        values = [row[index] for row in whole]
        for row, value in zip(whole, [*values[1:], values[0]], strict=True):
            row[index] = value
        return rows

    return edited


def without_zeros(column: str) -> Callable[[Rows], Rows]:
    """Return a function that removes leading zeros, as a spreadsheet does."""

    def edited(rows: Rows) -> Rows:
        index = rows[0].index(column)
        for row in rows[1:]:
            if len(row) == len(rows[0]):
                row[index] = row[index].lstrip("0")
        return rows

    return edited


DUMP_MISTAKES: tuple[Mistake, ...] = (
    Mistake(
        "convert: another source in tracks.txt",
        dump(tracks=added("source", 100)),
        CONVERT,
        message=(
            "tracks.txt: 100% of the plots that its 24 000 rows reference are not in plots.txt",
            "its sources are 126, 135, 141, 340, but the sources of plots.txt are 26, 35, 41",
        ),
    ),
    Mistake(
        "convert: another sensor in tracks.txt",
        dump(tracks=added("sensor", 100)),
        CONVERT,
        status=0,
        message=("26-110: tracks.txt contains this sensor, but plots.txt contains none",),
    ),
    *(
        Mistake(
            f"convert: latitude and longitude exchanged in {name}.txt",
            dump(**{name: exchanged("lat", "lon")}),
            CONVERT,
            message=(f"{name}.txt: its latitudes and longitudes are probably swapped",),
        )
        for name in ("plots", "tracks")
    ),
    Mistake(
        "convert: heights of plots_ads.txt in feet",
        dump(plots_ads=column_times("h", 1.0 / FOOT_M)),
        CONVERT,
        message=("adsb: its heights are probably in feet",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: heights of tracks.txt in feet",
        dump(tracks=column_times("h", 1.0 / FOOT_M)),
        CONVERT,
        message=("tracks.txt: its heights are probably in feet",),
    ),
    Mistake(
        "convert: tracks.txt with the track numbers of other rows",
        dump(tracks=of_other_rows("global")),
        CONVERT,
        message=("26-10: track_number probably belongs to other rows",),
        sensors=SENSORS,
    ),
    *(
        Mistake(
            f"convert: {name}.txt without its header line",
            dump(**{name: lambda rows: rows[1:]}),
            CONVERT,
            message=(f"{name}.txt: the header line is missing",),
        )
        for name in ("plots", "tracks")
    ),
    Mistake(
        "convert: times of tracks.txt in milliseconds",
        dump(tracks=column_times("time", 1e3)),
        CONVERT,
        message=("tracks.txt: 100% of its 34 162 records were rejected", "(milliseconds?)"),
    ),
    Mistake(
        "convert: codes without their leading zeros",
        dump(plots=without_zeros("code")),
        CONVERT,
        message=("plots.txt: ", "values of code have too few digits and were rejected"),
    ),
)
