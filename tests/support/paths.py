"""Where the checkout is, for tests that read its files."""

from pathlib import Path

TESTS = Path(__file__).parents[1]
ROOT = TESTS.parent
#: The recorded half hour that the documents and the demo use.
SAMPLE = ROOT / "examples" / "vid-sample"
