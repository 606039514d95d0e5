"""Failures of tracking in a recording with known truth."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import polars as pl

from validation.tracker import unseen_recordings as unseen

#: Consecutive plots of another aircraft that make a swap.
SWAP_PLOTS = 3
LATE_SCANS = 3.0
#: Minimum number of plots of an evaluated aircraft.
SEEN_PLOTS = 6
FALSE_S = 30.0
#: Consecutive plots without a track after which an aircraft is lost.
LOST_PLOTS = 5
#: An aircraft not detected for this time, s, may get another track.
UNSEEN_S = 30.0


@dataclass(frozen=True)
class Failure:
    """One failure: kind, time, aircraft, and a comment."""

    what: str
    time_s: float
    aircraft: int
    word: str


@dataclass(frozen=True)
class Result:
    """Results of a recording."""

    plots: int
    aircraft: int
    tracks: int
    right_share: float
    scans: "np.typing.NDArray[np.float64]"
    wait: int
    false_tracks: int
    rms_m: float
    failures: list[Failure]

    def count(self, what: str) -> int:
        """Return the number of failures of a kind."""
        return sum(one.what == what for one in self.failures)


def compare(tracks: pl.DataFrame, recording: unseen.Recording) -> Result:
    """Compare tracks with the truth of a recording."""
    keys = ["time_s", "sensor_id"]
    truth = recording.truth.select(
        *keys, pl.col("track_number").alias("aircraft"),
        pl.col("latitude_deg").alias("true_latitude"),
        pl.col("longitude_deg").alias("true_longitude"),
    ).unique(keys, keep="none")  # fmt: skip
    rows = tracks.join(truth, on=keys).sort("time_s", "sequence")
    confirmed = rows.filter(pl.col("state") != "tentative")
    owner = (
        confirmed.group_by("track_id", "aircraft").len()
        .sort("len", "aircraft", descending=[True, False], nulls_last=True)
        .group_by("track_id", maintain_order=True).first()
        .select("track_id", pl.col("aircraft").alias("owner"))
    )  # fmt: skip
    of = confirmed.join(owner, on="track_id").sort("time_s", "sequence")
    named = of.drop_nulls("aircraft")
    right = (named["aircraft"] == named["owner"]).fill_null(value=False)
    seen = truth.drop_nulls("aircraft").sort("time_s")
    failures, scans, wait = _late(seen, named, recording.periods_s)
    failures += _swaps(named) + _breaks(of, seen) + _lost(seen, named)
    false, more = _false(of)
    return Result(
        len(recording.measurements), seen["aircraft"].n_unique(), confirmed["track_id"].n_unique(),
        float(np.mean(right.to_numpy())) if len(right) else np.nan, scans, wait, false,
        _rms_m(named), sorted(failures + more, key=lambda one: (one.what, one.time_s)),
    )  # fmt: skip


def _late(
    seen: pl.DataFrame, named: pl.DataFrame, periods_s: dict[str, float]
) -> tuple[list[Failure], "np.typing.NDArray[np.float64]", int]:
    confirmed_s = dict(
        named.filter(pl.col("aircraft") == pl.col("owner"))
        .group_by("aircraft").agg(pl.col("time_s").min()).iter_rows()
    )  # fmt: skip
    failures, scans, worst = [], [], 0
    for (aircraft,), part in seen.group_by("aircraft", maintain_order=True):
        if len(part) < SEEN_PLOTS:
            continue
        times, first = part["time_s"].to_numpy(), part["sensor_id"][0]
        until = confirmed_s.get(aircraft, times[-1])
        late = (until - times[0]) / periods_s[first] + 1.0
        scans.append(late)
        in_time = int(np.sum(times <= times[0] + (LATE_SCANS - 1.0) * periods_s[first] + 1e-6))
        if late > LATE_SCANS + 0.01 and in_time >= 3:
            waited = int(np.sum(times <= until))
            worst = max(worst, waited)
            sensors = ",".join(part["sensor_id"][:6].to_list())
            word = f"{late:.1f} scans of {first}, {waited} plots: {sensors}"
            failures.append(
                Failure("late" if aircraft in confirmed_s else "never", times[0], aircraft, word)
            )
    return failures, np.array(scans), worst


def _swaps(named: pl.DataFrame) -> list[Failure]:
    found = []
    for (track,), part in named.group_by("track_id", maintain_order=True):
        numbers, times = part["aircraft"].to_numpy(), part["time_s"].to_numpy()
        cuts = np.flatnonzero(np.diff(numbers)) + 1
        runs = [
            (numbers[one[0]], times[one[0]])
            for one in np.split(np.arange(len(numbers)), cuts) if len(one) >= SWAP_PLOTS
        ]  # fmt: skip
        found += [
            Failure("swap", at, int(now), f"track {track} was of {before}")
            for (before, _), (now, at) in pairwise(runs) if before != now
        ]  # fmt: skip
    return found


def _breaks(of: pl.DataFrame, seen: pl.DataFrame) -> list[Failure]:
    """Return second tracks of an aircraft: beside the first, or after it."""
    found = []
    own = of.filter(pl.col("owner") == pl.col("aircraft"))
    lives = own.group_by("owner", "track_id").agg(
        pl.col("time_s").min().alias("start"), pl.col("time_s").max().alias("end")
    ).sort("owner", "start")  # fmt: skip
    for (owner,), part in lives.group_by("owner", maintain_order=True):
        times = seen.filter(pl.col("aircraft") == owner)["time_s"].to_numpy()
        for before, now in pairwise(part.iter_rows(named=True)):
            start, end = now["start"], before["end"]
            tracks = f"track {now['track_id']} after {before['track_id']}"
            if start < end:
                word = f"{tracks}, both for {min(end, now['end']) - start:.0f} s"
                found.append(Failure("duplicate", start, owner, word))
                continue
            between = times[(times >= end) & (times <= start)]
            unseen_s = float(np.max(np.diff(between), initial=0.0))
            # After a long gap another track is legitimate.
            what = "break" if unseen_s < UNSEEN_S else "gap"
            word = f"{tracks}, {len(between) - 2} plots between, unseen for {unseen_s:.0f} s"
            found.append(Failure(what, start, owner, word))
    return found


def _lost(seen: pl.DataFrame, named: pl.DataFrame) -> list[Failure]:
    """Return runs of plots of an aircraft with a track that updated no track."""
    found = []
    used = named.filter(pl.col("aircraft") == pl.col("owner")).select(
        "time_s", "sensor_id", used=pl.lit(value=True)
    )
    both = seen.join(used, on=["time_s", "sensor_id"], how="left").sort("time_s")
    for (aircraft,), part in both.group_by("aircraft", maintain_order=True):
        on = part["used"].fill_null(value=False).to_numpy()
        times = part["time_s"].to_numpy()
        if not on.any():
            continue
        first = int(np.argmax(on))
        cuts = np.flatnonzero(np.diff(on[first:])) + 1
        for one in np.split(np.arange(first, len(on)), cuts):
            if not on[one[0]] and len(one) >= LOST_PLOTS:
                lasted = times[one[-1]] - times[one[0]]
                word = f"{len(one)} plots in {lasted:.0f} s on no track of its own"
                found.append(Failure("lost", times[one[0]], aircraft, word))
    return found


def _false(of: pl.DataFrame) -> tuple[int, list[Failure]]:
    lives = of.filter(pl.col("owner").is_null()).group_by("track_id").agg(
        pl.col("time_s").min().alias("start"), pl.col("time_s").max().alias("end")
    ).sort("start")  # fmt: skip
    more = [
        Failure("false", start, -1, f"track {track} lives {end - start:.0f} s")
        for track, start, end in lives.iter_rows() if end - start > FALSE_S
    ]  # fmt: skip
    return len(lives), more


def _rms_m(named: pl.DataFrame) -> float:
    own = named.filter(pl.col("aircraft") == pl.col("owner"))
    north = np.radians((own["latitude_deg"] - own["true_latitude"]).to_numpy()) * 6.37e6
    east = np.radians((own["longitude_deg"] - own["true_longitude"]).to_numpy()) * 6.37e6
    east *= np.cos(np.radians(own["latitude_deg"].to_numpy()))
    return float(np.sqrt(np.mean(north**2 + east**2))) if len(own) else np.nan
