"""The table of cases: a command, and its right answer; README.md says the same in words.

Arguments that begin with ``@`` are files of the case's folder, with ``samples/`` the project's, with ``out/`` a
folder to write into.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bench.slips.slip import ROUTINE_FLAGS, Answer, Right
from tests.paths import PROJECT

HERE = Path(__file__).parent

_BASELINE_MM = 379.88
_VGA = ("--image-size", "640x480", "--pixel-size", "0.0074,0.0074")
_TO_JSON = ("--out", "out/rig.json")
_BOARDS = "samples/calibration/C1"
_LABELS = ("--labels", "L1,T11,T9,T7", "--spine-axis", "x")


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes
    ----------
    name
        Unique.
    command
        ``process``, ``calibrate`` or ``convert``.
    arguments
        Its arguments.
    right
        What counts as the right answer.
    """

    name: str
    command: str
    arguments: tuple[str, ...]
    right: Right

    def resolved(self, out: Path) -> list[str]:
        """Return the arguments with files in place; ``out`` is an empty folder."""
        return [_resolved(argument, out) for argument in self.arguments]


def _resolved(argument: str, out: Path) -> str:
    if argument.startswith("@"):
        return str(HERE / argument[1:])
    if argument.startswith("samples/"):
        return str(PROJECT / argument)
    return str(out / argument.removeprefix("out/")) if argument.startswith("out/") else argument


def _near_baseline(answer: Answer) -> bool:
    found = float(answer.document.get("geometry", {}).get("baseline_mm", 0.0))
    return abs(found - _BASELINE_MM) < 2 and not answer.codes - ROUTINE_FLAGS


def _converted(baseline: str) -> Callable[[Answer], bool]:
    return lambda answer: f"baseline {baseline}" in answer.message


def _tables(folder: str, right: Right, options: tuple[str, ...] = _VGA) -> Case:
    return Case(folder, "calibrate", (f"@{folder}/left.csv", f"@{folder}/right.csv", *options), right)


def _convert(name: str, source: str, form: str, right: Right, *more: str) -> Case:
    return Case(name, "convert", (f"@{source}", "--from", form, *_TO_JSON, *more), right)


def _field(name: str, right: Right, trial: str) -> Case:
    shot = (f"{_BOARDS}/{trial}/left.png", f"{_BOARDS}/{trial}/right.png")
    return Case(f"field {name}", "calibrate", (*shot, "--control-field", f"@field/{name}.csv"), right)


def _rig(name: str, right: Right, stage: str) -> Case:
    pair = (f"samples/D1/{stage}/left.png", f"samples/D1/{stage}/right.png")
    return Case(f"rig {name}", "process", (*pair, "--rig", f"@rig/{name}.json", *_LABELS), right)


def _stage(
    name: str, left: str, right_image: str, right: Right, labels: str = "L1,T11,T9,T7", axis: str = "x"
) -> Case:
    options = ("--rig", "samples/D1/rig.json", "--labels", labels, "--spine-axis", axis)
    return Case(name, "process", (left, right_image, *options), right)


def _boards(name: str, files: str, right: Right, *more: str) -> Case:
    sides = {"l": "left", "r": "right"}
    images = (f"{_BOARDS}/{word[0]}/{sides[word[1]]}.png" for word in files.split())
    return Case(name, "calibrate", (*images, "--control-field", "pegboard-1995", *more), right)


_ACCEPTED = Right(sound=_near_baseline)
_PIXEL_SIZE = Right(refusal=r"pixel.?size", flags=("pixel-size-doubtful",))
_NORMALIZED = Right(refusal=r"normalized|one pixel")
_FIELDS = Right(refusal=r"line \d+.*(fields|columns|comma)|(fields|columns|comma).*line \d+")
_UNIT = Right(refusal=r"metre|unit|inch|baseline|_mm")
_DRIFT = Right(flags=("calibration-drift",))
_SWAPPED = Right(refusal=r"exchange|swap", flags=("no-triads",), detail=r"exchange|swap")
_NO_TRIADS = Right(refusal=r"rig|calibration", flags=("no-triads", "calibration-drift"))
_TOO_MANY = Right(flags=("triad-count-high",), labels_null=True)
_LEVELS = Right(refusal=r"spacing|level", flags=("levels-implausible", "labels-uncertain"), labels_null=True)
_DISTORTION = Right(refusal=r"distortion|model|carried|fold")

_TABLES = (
    _tables("table-sound", _ACCEPTED),
    Case(
        "table without a pixel size",
        "calibrate",
        ("@table-sound/left.csv", "@table-sound/right.csv", "--image-size", "640x480"),
        _PIXEL_SIZE,
    ),
    Case(
        "table with a pixel size in micrometres",
        "calibrate",
        (
            "@table-sound/left.csv",
            "@table-sound/right.csv",
            "--image-size",
            "640x480",
            "--pixel-size",
            "7.4,7.4",
        ),
        _PIXEL_SIZE,
    ),
    Case(
        "table with another image's size",
        "calibrate",
        (
            "@table-sound/left.csv",
            "@table-sound/right.csv",
            "--image-size",
            "480x640",
            "--pixel-size",
            "0.0074,0.0074",
        ),
        Right(refusal=r"outside|image.?size"),
    ),
    Case(
        "table with sides exchanged",
        "calibrate",
        ("@table-sound/right.csv", "@table-sound/left.csv", *_VGA),
        Right(refusal=r"exchange|swap"),
    ),
    _tables("table-normalized", _NORMALIZED),
    _tables("table-camera-coordinates", _NORMALIZED),
    _tables("table-decimal-commas", _FIELDS),
    _tables("table-row-shifted", _FIELDS),
    _tables("table-column-twice", Right(refusal=r"v_px.*twice|twice.*v_px")),
    _tables("table-object-column-twice", Right(refusal=r"x_mm.*twice|twice.*x_mm")),
    _tables("table-metres", _UNIT),
    _tables("table-inches", _UNIT),
    _tables("table-double-size", Right(refusal=r"outside|image.?size")),
    _tables("table-byte-order-mark", _ACCEPTED),
    _tables("table-windows-line-ends", _ACCEPTED),
    _tables("table-semicolons", _ACCEPTED),
    _tables("table-semicolons-commas", Right(refusal=r"comma|semicolon", sound=_near_baseline)),
    _tables("table-u-v-exchanged", Right(refusal=r"mirror|exchange|columns")),
    _tables("table-v-upwards", Right(refusal=r"mirror|down")),
    _tables("table-two-boards", Right(refusal=r"other object coordinates|differ|contradict")),
    _field("decimal_commas", _FIELDS, "B"),
    _field("metres", _UNIT, "A"),
    _field("column_twice", Right(refusal=r"y_mm.*twice|twice.*y_mm"), "F"),
    _field("semicolons", Right(sound=lambda a: "rig" in a.document and not a.codes), "B"),
)

_CAMERA_FILES = (
    _convert("opencv sound", "opencv/sound.yml", "opencv", Right(sound=_converted("379.9")), *_VGA[2:]),
    _convert(
        "opencv of 720p",
        "opencv/of_720p.yml",
        "opencv",
        Right(refusal=r"camera.?matrix|principal|image size|\bK\b"),
    ),
    _convert("opencv transposed", "opencv/transposed.yml", "opencv", Right(refusal=r"transpos")),
    _convert("opencv fisheye", "opencv/fisheye.yml", "opencv", _DISTORTION),
    _convert("opencv folded", "opencv/folded.yml", "opencv", _DISTORTION),
    _convert("opencv eight coefficients", "opencv/eight.yml", "opencv", _DISTORTION),
    _convert("opencv without dt", "opencv/no_dt.yml", "opencv", Right(refusal=r"camera_matrix|dt|matrix")),
    _convert(
        "opencv eight numbers",
        "opencv/eight_numbers.yml",
        "opencv",
        Right(refusal=r"rotation_matrix|entries|elements"),
    ),
    _convert("opencv translations in metres", "opencv/translations_metres.yml", "opencv", _UNIT),
    _convert("opencv as ROS writes", "opencv/ros.yml", "opencv", Right(refusal=r"ROS|opencv-matrix|matrix")),
    _convert(
        "opencv intrinsics and extrinsics",
        "opencv-stereo/intrinsics.yml",
        "opencv",
        Right(sound=_converted("379.9")),
        "--image-size",
        "640x480",
        *_VGA[2:],
    ),
    _convert("1995 sound", "thesis-1995/sound.txt", "1995", Right(sound=_converted("379.9")), *_VGA),
    _convert(
        "1995 decimal degrees",
        "thesis-1995/decimal_degrees.txt",
        "1995",
        Right(refusal=r"DDDMMSS|decimal|angle"),
        *_VGA,
    ),
    _convert(
        "1995 radians", "thesis-1995/radians.txt", "1995", Right(refusal=r"DDDMMSS|radian|angle"), *_VGA
    ),
    _convert(
        "1995 degrees and minutes",
        "thesis-1995/degrees_minutes.txt",
        "1995",
        Right(refusal=r"DDDMMSS|angle"),
        *_VGA,
    ),
    _convert("openptv sound", "openptv-sound", "openptv", Right(sound=_converted("379.9")), *_VGA),
    _convert("openptv degrees", "openptv-degrees", "openptv", Right(refusal=r"radian|degrees|angle"), *_VGA),
    _convert(
        "openptv contradiction",
        "openptv-contradiction",
        "openptv",
        Right(refusal=r"matri|contradict", warning=r"matri|contradict"),
        *_VGA,
    ),
    _convert("json key twice", "rig/key_twice.json", "json", Right(refusal=r"radial.*twice|twice.*radial")),
    _convert(
        "json huge integer", "rig/huge_integer.json", "json", Right(refusal=r"focal_length_mm|finite|number")
    ),
    _convert("json byte-order mark", "rig/byte_order_mark.json", "json", Right(sound=_converted("379.9"))),
    _convert(
        "json baseline 1e-300", "rig/baseline_1e-300.json", "json", Right(refusal=r"position_mm|baseline")
    ),
    _convert("json focal length 1e12", "rig/focal_1e12.json", "json", Right(refusal=r"focal_length_mm")),
    _convert("json cameras look up", "rig/looking_up.json", "json", Right(refusal=r"rotation_deg|look")),
)

_RIGS = (
    _rig("metres", _UNIT, "INTER"),
    _rig("micrometres", Right(refusal=r"pixel_size_mm|micrometre"), "POST"),
    _rig("radians", Right(refusal=r"rotation_deg|radian|vergence"), "PRE"),
    _rig("focal_px", Right(refusal=r"focal_length_mm|field of view"), "INTER"),
    _rig("looking_up", Right(refusal=r"rotation_deg|look"), "POST"),
    _rig("focal_1e12", Right(refusal=r"focal_length_mm"), "PRE"),
    _rig("baseline_1e-300", Right(refusal=r"position_mm|baseline"), "INTER"),
    _rig("exchanged", _SWAPPED, "INTER"),
    _rig("yawed", _DRIFT, "PRE"),
    _rig("base_longer", _DRIFT, "INTER"),
    _rig("pitched", _NO_TRIADS, "INTER"),
    _rig("other_cart", _NO_TRIADS, "POST"),
)

_PRE, _INTER, _POST = (
    (f"samples/D1/{stage}/left.png", f"samples/D1/{stage}/right.png") for stage in ("PRE", "INTER", "POST")
)

_STAGES = (
    _stage(
        "stage sound", *_INTER, Right(sound=lambda a: a.labels == ("L1", "T11", "T9", "T7") and not a.codes)
    ),
    _stage("stage swapped", _POST[1], _POST[0], _SWAPPED),
    _stage(
        "stage of two moments",
        _INTER[0],
        _POST[1],
        Right(flags=("no-triads", "pair-mixed", "calibration-drift")),
    ),
    _stage("stage with two names", *_INTER, _TOO_MANY, "T11,T7"),
    _stage("stage with three names", *_PRE, _TOO_MANY, "L1,T11,T7"),
    _stage("stage with shuffled names", *_INTER, Right(refusal=r"order|sequence"), "T11,L1,T9,T7"),
    _stage("stage with L8", *_POST, Right(refusal=r"L8"), "L8,T11,T9,T7"),
    _stage("stage with T42", *_PRE, Right(refusal=r"T42"), "L1,T42,T9,T7"),
    _stage(
        "stage with one vertebra in two spellings", *_INTER, Right(refusal=r"twice|same"), "T11,t11,T9,T7"
    ),
    _stage("stage with neighbours' names", *_POST, _LEVELS, "L2,L1,T12,T11"),
    _stage("stage with one name wrong", *_INTER, _LEVELS, "L1,T10,T9,T7"),
    _stage(
        "stage along the other axis",
        *_INTER,
        Right(
            refusal=r"axis",
            flags=("levels-implausible", "labels-uncertain", "spine-axis-implausible"),
            labels_null=True,
        ),
        axis="y",
    ),
)

_AGREE = Right(refusal=r"agree|order|left.*right")

_CALIBRATIONS = (
    _boards("boards sound", "Al Ar Bl Br", Right(sound=lambda a: not a.codes - ROUTINE_FLAGS)),
    _boards("boards, left ones first", "Al Cl Ar Cr", _AGREE),
    _boards("boards, left ones first, three shots", "Fl Al Cl Fr Ar Cr", _AGREE),
    _boards("boards, second shot swapped", "Bl Br Cr Cl", Right(refusal=r"exchange|swap|agree")),
    _boards(
        "boards, second shot of two moments",
        "Fl Fr Cl Ar",
        Right(refusal=r"agree|moment|fit", flags=("calibration-poor",)),
    ),
    _boards("board verifies itself", "Fl Fr Fl Fr", Right(refusal=r"same|twice|copy|once"), "--verify", "1"),
    _boards("board with a pixel size in micrometres", "Bl Br", _PIXEL_SIZE, "--pixel-size", "10,8.45"),
)

CASES = (*_TABLES, *_CAMERA_FILES, *_RIGS, *_STAGES, *_CALIBRATIONS)

DERIVED = (
    "16-bit TIFF with white as zero, PRE",
    "Sun raster with run lengths at odd width, PRE",
    "signed 16-bit TIFF, INTER",
    "12 bits in 16-bit colour, INTER",
    "one hot pixel in a 12-bit image, POST",
    "right exposed by 0.5, POST",
    "motion of 7 px while exposing, PRE",
    "defocus of 2.5 px, INTER",
    "rolling bands of 50% in one view, POST",
    "one field of an interlaced frame, INTER",
    "fields 4 px apart, PRE",
    "JPEG of quality 40, INTER",
    "JPEG of quality 40, saved again as PNG, PRE",
    "JPEG with a flipped bit at 35%, PRE",
    "the left image twice, with other noise",
    "its copy as TIFF verifies a shot",
    "a folder whose name is not UTF-8, with a report",
    "a database folder that cannot be written",
)
"""Slips of bench.mistakes whose files are too large to keep, made from the samples when the test runs."""
