"""The region of the service and its neighbours."""

import json
from typing import Any

from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.regions.board import RegionBoard

#: Of a service without neighbours.
NO_REGIONS: dict[str, Any] = {
    "name": None, "margin_m": None, "responsible": 0, "duplicates": 0, "takeovers": 0,
    "neighbours": [],
}  # fmt: skip


def answer_regions(known: Knowledge) -> dict[str, Any]:
    """Return the region of the service and its neighbours, the fields of `Regions`.

    Parameters
    ----------
    known : Knowledge
        Present data of the service.
    """
    if known.regions is None:
        return NO_REGIONS
    document = known.regions()
    ours = set(known.sensors.ids)
    for one in document["neighbours"]:
        one["biases"] = [bias for bias in one["biases"] if bias["sensor_id"] in ours]
    return document


def region_document(regions: RegionBoard) -> dict[str, Any]:
    """Return the regions with all biases that the neighbours handed over."""
    figures = regions.figures()
    for one in figures["neighbours"]:
        one["biases"] = [json.loads(text) for text in regions.biases(one["name"])]
    del figures["unusable"]
    return {"name": regions.name, "margin_m": regions.rules.margin_m, **figures}
