"""Track rows of a dump that reference plots which are not in it."""

from collections.abc import Collection, Mapping
from typing import Any

from multiradar.diagnosis.losses import READ_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import counted

#: Where more than this fraction of the referenced plots is missing, the files do not belong
#: together.
MISSING_MAX = 0.5
_MONORADAR = "_mr"


def check_references(report: Mapping[str, Any], sources: Collection[str]) -> list[Diagnosis]:
    """Diagnose tracks whose plots are missing, by their sources.

    Parameters
    ----------
    report : mapping
        The report of the conversion.
    sources : collection of str
        Sources of the plots.
    """
    figures = report["figures"]
    tracks = _file(figures, "tracks")
    named = figures.get("track_rows_naming_a_plot", 0)
    if not tracks or named < READ_MIN:
        return []
    missing = figures["track_rows_whose_plot_is_missing"] / named
    if missing > MISSING_MAX:
        return [_missing(figures, tracks, missing, sources, report["settings"])]
    return [
        Diagnosis(
            name,
            "sensor_without_plots",
            f"{name}: {tracks} contains this sensor, but {_file(figures, 'plots')} contains none "
            "of its plots: the sensor columns probably differ; the plots are associated by their "
            "sources and numbers",
            "warning",
        )
        for name in figures.get("sensors_without_plots", ())
    ]


def _missing(
    figures: Mapping[str, Any],
    tracks: str,
    missing: float,
    sources: Collection[str],
    settings: Mapping[str, Any],
) -> Diagnosis:
    plots = _file(figures, "plots")
    own = [one.removesuffix(_MONORADAR) for one in figures["tracks_written"] if _is_radar(one)]
    own = [one for one in own if one != str(settings["multiradar_source"])]
    why = (
        "the plot numbers or the times of the two files differ; check that both files belong to "
        "one recording"
    )
    if own and not set(own) & set(sources):
        why = (
            f"its sources are {', '.join(own)}, but the sources of {plots} are "
            f"{', '.join(sources)}; correct the source column, or convert the tracks of this "
            "recording"
        )
    return Diagnosis(
        "",
        "plots_missing",
        f"{tracks}: {missing:.0%} of the plots that its {counted(_named(figures))} rows reference "
        f"are not in {plots}: {why}",
    )


def _named(figures: Mapping[str, Any]) -> int:
    return int(figures["track_rows_naming_a_plot"])


def _is_radar(stem: str) -> bool:
    return stem.endswith(_MONORADAR)


def _file(figures: Mapping[str, Any], table: str) -> str:
    files = figures.get("files", {}).items()
    return next((name for name, one in files if one.get("table") == table), "")
