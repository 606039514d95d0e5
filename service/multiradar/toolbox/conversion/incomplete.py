"""What makes a conversion incomplete: a truncated file, an option for another recording."""

from collections.abc import Callable
from pathlib import Path
from typing import Any


def incomplete(kind: str, report: dict[str, Any], out: Path) -> str:
    """Return the main reason why a conversion is incomplete; empty if it is complete.

    Parameters
    ----------
    kind : str
        vid, asterix or adsb.
    report : dict
        Contents of `report.json`.
    out : Path
        The folder that was made.
    """
    found = (check(report, out) for check in _CHECKS[kind])
    return next((sentence for sentence in found if sentence), "")


# The amount of missing data is unknown; what was read is kept.
def _truncated(report: dict[str, Any], out: Path) -> str:
    cut = [f"{file}: {reason}" for file, reason in report["figures"]["cut_short"].items()]
    if not cut:
        return ""
    return f"{'; '.join(cut)}; probably truncated during copying; the readable part is in {out}"


def _truncated_adsb(report: dict[str, Any], out: Path) -> str:
    cut = [
        name
        for name, account in report["figures"]["files"].items()
        if "TRUNCATED" in account["rejected_by_code"]
    ]
    return f"{', '.join(cut)}: truncated; the readable part is in {out}" if cut else ""


def _without_reference_point(report: dict[str, Any], out: Path) -> str:
    missing: dict[str, int] = report["figures"]["unreferenced"]
    if not missing:
        return ""
    counts = ", ".join(f"{count:,} reports of {name}" for name, count in missing.items())
    first = next(iter(missing))
    return (
        f"{counts} have local coordinates only, and their reference point is unknown; specify "
        f"it with --reference {first}=LATITUDE,LONGITUDE, or as latitude_deg and longitude_deg "
        f"of the sensor in --sensors; {out} contains the other reports"
    )


# Options that the recording contradicts.
def _contradicted_options(report: dict[str, Any], out: Path) -> str:
    settings, figures = report["settings"], report["figures"]
    found = [
        f"--reference {name}={','.join(map(str, settings['references'][name]))}: {why}"
        for name, why in figures.get("misplaced_references", {}).items()
    ]
    if captured := figures.get("captured_date"):
        found.append(
            f"--date {settings['date']}: the recording was captured on {captured}, according to "
            "its packet times"
        )
    if not found:
        return ""
    return f"{'; '.join(found)}; correct or omit the option; {out} was written with this option"


# An option for a source that is not in the recording is a misspelt one.
def _unused_options(report: dict[str, Any], out: Path) -> str:
    records: dict[str, dict[str, int]] = report["figures"]["records_by_sensor"]
    sources = {name for of_category in records.values() for name in of_category}
    unused = [
        f"--edition {name}={edition}"
        for name, edition in report["settings"]["editions"].items()
        if not _is_recorded(name, records)
    ]
    unused += [
        f"--reference {name}" for name in report["settings"]["references"] if name not in sources
    ]
    if not unused:
        return ""
    recorded = "; ".join(f"{one} of {', '.join(of)}" for one, of in records.items())
    return (
        f"{', '.join(unused)}: not in the recording, which contains {recorded}; correct or omit "
        f"the option; {out} was written without this option"
    )


def _is_recorded(name: str, records: dict[str, dict[str, int]]) -> bool:
    source, _, category = name.rpartition("/")
    return category in records and (not source or source in records[category])


_CHECKS: dict[str, tuple[Callable[[dict[str, Any], Path], str], ...]] = {
    "vid": (),
    "asterix": (
        _truncated,
        _without_reference_point,
        _unused_options,
        _contradicted_options,
    ),
    "adsb": (_truncated_adsb,),
}
