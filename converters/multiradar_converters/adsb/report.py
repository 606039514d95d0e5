"""`report.json` of a conversion."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from multiradar_converters.adsb.options import Options
from multiradar_converters.adsb.table import Written
from multiradar_converters.errors import AccountingError
from multiradar_converters.report_file import Converted, write_report
from multiradar_schemas.reject import RejectCode


@dataclass
class FileAccount:
    """Disposition of the records of a file.

    Attributes
    ----------
    file, form : str
        Its name and form.
    size, text_bytes : int
        Its size, and that of its text, bytes.
    layout : dict
        Detected columns.
    read : int
        Records, including text that is not a record.
    accepted, repeated, stale, backwards, jumps : int
        Counts of reports; rejected includes repeated and stale ones.
    duplicate : int
        Of feeds: reports that repeat the last position of an aircraft.
    without_position : int or None
        Messages of a feed without a position; they are not reports. None for other files.
    old_registers : int
        Reports of a feed without values of registers that may be old.
    unreadable : dict
        Unreadable values that were omitted, by role.
    blank : int
        Blank lines.
    quantities : set of str
        Aircraft-derived data that any record has.
    first_day : int or None
        Day of the recording on which the file starts, 0 for the first one; None with dates.
    note : str
        Why it is on a later day than another file; empty if it is not.
    rejected : Counter
        Records by code.
    examples : dict
        First example of each code, with its place.
    """

    file: str
    form: str
    layout: dict[str, object]
    size: int = 0
    text_bytes: int = 0
    read: int = 0
    accepted: int = 0
    repeated: int = 0
    stale: int = 0
    backwards: int = 0
    jumps: int = 0
    duplicate: int = 0
    without_position: int | None = None
    old_registers: int = 0
    unreadable: Counter[str] = field(default_factory=Counter)
    blank: int = 0
    quantities: set[str] = field(default_factory=set)
    first_day: int | None = None
    note: str = ""
    rejected: Counter[RejectCode] = field(default_factory=Counter)
    examples: dict[RejectCode, str] = field(default_factory=dict)

    def check(self) -> None:
        """Check that read = accepted + rejected + duplicate.

        Raises
        ------
        AccountingError
            A record is unaccounted for.
        """
        accounted = self.accepted + self.rejected.total() + self.duplicate
        if accounted != self.read:
            msg = f"{self.file}: read {self.read} records, but accounted for {accounted}"
            raise AccountingError(msg)

    def counts(self) -> dict[str, int]:
        """Return the counts of `report.json`."""
        return {
            "read": self.read,
            "accepted": self.accepted,
            "rejected": self.rejected.total(),
            "duplicate": self.duplicate,
            "blank": self.blank,
        }

    def figures(self) -> dict[str, object]:
        """Return the account for `report.json`."""
        return {
            "form": self.form,
            **({} if self.first_day is None else {"first_day": self.first_day}),
            **self.layout,
            "text_bytes": self.text_bytes,
            "repeated": self.repeated,
            "stale": self.stale,
            "backwards": self.backwards,
            "jumps": self.jumps,
            "unreadable": dict(sorted(self.unreadable.items())),
            "rejected_by_code": {str(code): n for code, n in sorted(self.rejected.items())},
            **(
                {} if self.without_position is None else {"without_position": self.without_position}
            ),
        }


def report_json(
    path: Path, accounts: list[FileAccount], written: Written, options: Options
) -> dict[str, object]:
    """Write and return the report.

    Parameters
    ----------
    path : Path
        The file.
    accounts : list of FileAccount
        Accounts of the files.
    written : Written
        Figures of the table.
    options : Options
        Options.

    Returns
    -------
    dict
        The report, ready for JSON.
    """
    by_code: Counter[RejectCode] = Counter()
    for account in accounts:
        by_code.update(account.rejected)
    converted = Converted(
        command="convert adsb",
        inputs=[(account.file, account.size, account.counts()) for account in accounts],
        rejected_by_code=by_code,
        measurements=written.rows,
        settings=options.settings(),
        figures=_figures(accounts, written),
        duplicates=written.repeated,
    )
    return write_report(path, converted)


def _figures(accounts: list[FileAccount], written: Written) -> dict[str, object]:
    return {
        "files": {account.file: account.figures() for account in accounts},
        "moved_files": [account.note for account in accounts if account.note],
        "aircraft": len(written.addresses),
        "measurements": {kind: count for kind, count in written.kinds.items() if count},
        "heights": written.heights,
        "on_ground": written.on_ground,
        **{
            name: sum(getattr(account, name) for account in accounts)
            for name in ("repeated", "stale", "backwards", "jumps")
        },
        **_aircraft_data(written),
        "first_s": written.first_s if written.rows else None,
        "last_s": written.last_s if written.rows else None,
    }


def _aircraft_data(written: Written) -> dict[str, object]:
    documents = {kind: figures.document() for kind, figures in written.data.items()}
    found = {kind: document for kind, document in documents.items() if document}
    return {"aircraft_data": found} if found else {}
