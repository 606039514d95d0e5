"""Mode 3/A codes of a sensor that are written as decimal numbers."""

import polars as pl

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.model import Diagnosis

#: Fraction of the codes that have a digit which no octal number has, at least; a garbled code has
#: none. Decimal codes of all aircraft have one in half of the cases.
_NOT_OCTAL_MIN = 0.02
#: Greatest code.
_CODE_MAX = 0o7777


def check_decimal_codes(name: str, codes: pl.Series) -> Diagnosis | None:
    """Diagnose codes with the digits 8 and 9, which are rejected, beside others without them.

    Parameters
    ----------
    name : str
        The sensor.
    codes : (n,) Series of String
        Codes as recorded, also of rejected measurements.
    """
    known = codes.drop_nulls()
    numbers = known.filter(known.str.contains(r"^[0-9]{1,4}$"))
    wrong = int(numbers.str.contains("[89]").sum())
    if len(numbers) < len(known) or wrong < max(TESTED_MIN, _NOT_OCTAL_MIN * len(known)):
        return None
    if numbers.cast(pl.Int64).max() > _CODE_MAX:  # type: ignore[operator]  # of integers
        return None
    return Diagnosis(
        name,
        "codes",
        f"{name}: its Mode 3/A codes (mode_3a) are probably decimal numbers: "
        f"{wrong / len(known):.0%} have the digits 8 or 9, and none exceeds {_CODE_MAX}; write "
        "them as four octal digits",
    )
