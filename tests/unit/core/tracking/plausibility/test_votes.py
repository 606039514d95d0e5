"""Votes of sites on the reports of an aircraft, site by site."""

import numpy as np

from multiradar.tracking.lifecycle.report_integrity import SECTORS, ReportIntegrity, Watch
from multiradar.tracking.plausibility._comparison_kernels import (
    CREDIT_MIN,
    FRESH_SCANS,
    LONE_CONTRADICTIONS,
    vote,
)

SENSORS, AIRCRAFT, NOW_S, PERIOD_S = 12, 5, 1000.0, 4.0
Numbers = np.ndarray[tuple[int], np.dtype[np.int64]]


def _watch(random: np.random.Generator) -> Watch:
    return Watch(
        self_reported=(random.random(SENSORS) < 0.2).astype(np.int64),
        kind=np.zeros(SENSORS, np.int64),
        period=np.full(SENSORS, PERIOD_S),
        range_max=np.full(SENSORS, 4e5),
        alive=np.full(SENSORS, NOW_S),
        farthest=np.zeros(SENSORS),
        lowest=np.full((SENSORS, SECTORS), np.inf),
        support_s=12.0,
        suspect_s=16.0,
    )


def _expected(sites: Numbers, watch: Watch, integrity: ReportIntegrity) -> tuple[bool, bool]:
    fresh = NOW_S - integrity.compared_at <= FRESH_SCANS * watch.period
    valid = fresh & (watch.self_reported == 0)

    def agreement(aircraft: int, site: int) -> int:
        mine = valid[aircraft] & (sites == site)
        return int(integrity.agreement[aircraft][mine].sum())

    def is_credible(site: int) -> bool:
        others = [one for one in range(1, AIRCRAFT) if integrity.owner[one] >= 0]
        outliers = integrity.outliers[:, sites == site].sum(axis=1)
        backing = sum(agreement(one, site) > 0 and outliers[one] == 0 for one in others)
        opposing = sum(agreement(one, site) < 0 or outliers[one] > 0 for one in others)
        persists = integrity.contradictions[0, sites == site].max() >= LONE_CONTRADICTIONS
        return bool(persists and backing >= CREDIT_MIN and backing > opposing)

    # Sites of moving sensors have numbers beyond those of the sensors, and no vote.
    present = [site for site in set(sites.tolist()) if site < SENSORS]
    votes = {site: agreement(0, site) for site in present}
    against = [site for site, one in votes.items() if one < 0]
    agreeing = sum(one > 0 for one in votes.values())
    lost = len(against) > agreeing + 1
    if len(against) == agreeing + 1:
        lost = all(is_credible(site) for site in against)
    return lost, agreeing > len(against)


def test_sites_vote_once_with_their_valid_comparisons() -> None:
    random = np.random.default_rng(12)
    seen = set()
    for _ in range(400):
        integrity = ReportIntegrity.empty(AIRCRAFT, SENSORS)
        integrity.owner[:] = random.integers(-1, 3, AIRCRAFT)
        integrity.agreement[:] = random.integers(-1, 2, (AIRCRAFT, SENSORS))
        integrity.agreement[1:] = np.where(random.random((AIRCRAFT - 1, SENSORS)) < 0.7, 1, 0)
        integrity.contradictions[:] = random.integers(0, 6, (AIRCRAFT, SENSORS))
        integrity.outliers[:] = random.random((AIRCRAFT, SENSORS)) < 0.05
        age_s = PERIOD_S * FRESH_SCANS * random.uniform(0.0, 2.0, (AIRCRAFT, SENSORS))
        integrity.compared_at[:] = NOW_S - age_s
        integrity.compared_at[0, random.random(SENSORS) < 0.4] = -np.inf
        sites = np.minimum(np.arange(SENSORS), random.integers(0, SENSORS, SENSORS))
        sites[random.random(SENSORS) < 0.1] = SENSORS + 1
        watch = _watch(random)
        expected = _expected(sites, watch, integrity)
        assert vote(0, NOW_S, sites, watch, integrity) == expected
        seen.add(expected)
    assert len(seen) == 3
