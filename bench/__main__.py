"""``python -m bench``: list the areas that can be measured."""

from __future__ import annotations

from bench.tables import Grid

AREAS = {
    "bench.scenes DIR [--check] [--json FILE]": "accuracy, recall and honesty on rendered scenes with truth",
    "bench.detection [DIR] [--check] [--json FILE]": "recall, centres, field, time and memory of detection, with peers",
    "bench.selectivity [DIR]": "Tables 4.1 to 4.3 of the thesis on rendered scenes",
    "bench.matching [DIR] [--check] [--json FILE]": "from features to poses: recall, coverage, drift, speed, limits",
    "bench.lamp_shift DIR...": "displacement of centres towards the lamp in rendered pairs",
    "bench.large_balls [--examples N] [--check]": "centres of simulated balls of 20 px",
    "bench.doubt DIR...": "chance that a triad is false: its fit, and the chances beside the truth",
    "bench.speed [--check] [--json FILE]": "time of one stereo pair beside OpenCV's masked template matching",
    "bench.load [--part PART] [--rounds N] [--hours H] [--check] [--json FILE]": "the service under load and kill -9",
    "bench.mistakes [--check] [--kind KIND] [--only TEXT] [--json FILE]": "mistakes of users and the answer to each",
    "bench.hosts [--experiment NAME] [--check] [--json FILE]": "hosts that fail: API, workers, database, queue",
    "bench.spine [--part PART] [--check] [--json FILE]": "spines: Cobb, intervals, attribution, bursts, gates",
    "bench.radiographs [--pairs N] [--sd-px PX] [--check]": "initial configurations from simulated radiographs",
    "bench.accuracy DIR [--out FILE]": "both, written to docs/accuracy.md",
    "bench.calibration [--boards DIR] [--scenes DIR] [--check]": "calibration on boards and real data, beside peers",
    "bench.thesis [DIR] [--part PART] [--check]": "every table of the thesis beside ours",
    "bench.figure [FILE]": "draws docs/img/result.png, the measured triads of the sample",
}


def main() -> None:
    """Print the areas."""
    Grid.of("Benchmarks", ["python -m ...", "what it shows"], AREAS.items()).print()


if __name__ == "__main__":
    main()
