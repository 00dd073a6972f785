"""``python -m bench``: list the areas that can be measured."""

from __future__ import annotations

from bench.tables import Grid

AREAS = {
    "bench.scenes DIR [--check] [--json FILE]": "accuracy, recall and honesty on rendered scenes with truth",
    "bench.speed [--check] [--json FILE]": "time of one stereo pair beside OpenCV's masked template matching",
    "bench.accuracy DIR [--out FILE]": "both, written to docs/accuracy.md",
    "bench.picture [FILE]": "draws docs/img/result.png, the measured triads of the sample",
}


def main() -> None:
    """Print the areas."""
    Grid.of("Benchmarks", ["python -m ...", "what it shows"], AREAS.items()).print()


if __name__ == "__main__":
    main()
