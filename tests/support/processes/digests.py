"""The digests of a batch by some filters; also as a program: the file of the batch, the filters."""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import sensor_table, three_radars


def digests(batch: Path, filters: Sequence[str]) -> list[str]:
    """Return the digest of each filter, of the columns in a file of numpy."""
    found = []
    for name in filters:
        digest = OutputDigest()
        engine = Engine(sensor_table(three_radars()), TrackingSettings(filter_name=name), 1)
        digest.add(engine.push(MeasurementBatch(**np.load(batch))))
        digest.add(engine.flush())
        engine.close()
        found.append(digest.hexdigest())
    return found


if __name__ == "__main__":
    sys.stdout.write(" ".join(digests(Path(sys.argv[1]), sys.argv[2:])))
