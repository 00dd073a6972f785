"""Where the tests find the project's files."""

from pathlib import Path

PROJECT = Path(__file__).parents[1]
SAMPLES = PROJECT / "samples"
DATA = PROJECT / "tests" / "data"
