"""Days of archives for the tests of `reprocess`."""

from pathlib import Path

import pytest

from validation.tracker.archive_days import write_days

#: Step of the radar `east` on the third day, m.
STEP_M = 60.0


@pytest.fixture(scope="package")
def archive(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return a folder with four days and their sensors file; not changed by tests."""
    folder = tmp_path_factory.mktemp("archive") / "days"
    return folder, write_days(folder, [0.0, 0.0, STEP_M, STEP_M])
