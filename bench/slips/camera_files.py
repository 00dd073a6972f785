"""Slips of camera files: ``convert`` of rigs that other programs wrote, or people edited."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from bench.slips.run import run_command
from bench.slips.slip import Answer, Right, Slip
from bench.slips.sound import SIDES, RigJson, camera_of, changed_rig, each_camera, rig, write_rig

Edit = Callable[[str], str]
_ANGLES = slice(3, 6)


def slips() -> Iterator[Slip]:
    """Yield the slips of camera files."""
    yield from _opencv()
    yield from _opencv_parts()
    yield from _thesis()
    yield from _openptv()
    yield from _json()


def _opencv() -> Iterator[Slip]:
    matrix = r"camera.?matrix|principal point|\bK\b"
    cases: tuple[tuple[str, Edit, Right], ...] = (
        (
            "OpenCV: matrix of a 1920x1080 sensor",
            _matrices("camera_matrix", lambda _: [1500.0, 0, 960, 0, 1500.0, 540, 0, 0, 1]),
            Right(refusal=matrix),
        ),
        (
            "OpenCV: matrix of half the size",
            _matrices("camera_matrix", lambda k: [*(v / 2 for v in k[:6]), 0, 0, 1]),
            Right(refusal=matrix),
        ),
        ("OpenCV: matrices transposed", _matrices("camera_matrix", _transposed), Right(refusal=r"transpos")),
        (
            "OpenCV: rotation of the camera in space, position for t",
            _camera_in_space,
            Right(refusal=r"rotation|translation|look|field"),
        ),
        (
            "OpenCV: focal length in mm",
            _matrices("camera_matrix", lambda k: [7.8, 0, k[2], 0, 7.8, k[5], 0, 0, 1]),
            Right(refusal=rf"{matrix}|focal"),
        ),
        (
            "OpenCV: translations in metres",
            _matrices("translation_vector", lambda t: [v / 1000 for v in t]),
            Right(refusal=r"translation|baseline|metre|position"),
        ),
        (
            "OpenCV: distortion that folds",
            _matrices("distortion_coefficients", lambda _: [-1.5, 0, 0, 0, 0]),
            Right(refusal=r"distortion|fold|carried"),
        ),
        (
            "OpenCV: strong distortion",
            _matrices("distortion_coefficients", lambda _: [-0.42, 0.31, 0, 0, -0.28]),
            Right(refusal=r"distortion|carried"),
        ),
        ("OpenCV: eight coefficients", _eight, Right(refusal=r"distortion|carried|8|eight")),
        ("OpenCV: fisheye", _fisheye, Right(refusal=r"fisheye|model|distortion")),
        (
            "OpenCV: a matrix of eight numbers",
            _short_matrix,
            Right(refusal=r"camera_matrix|entries|elements"),
        ),
        (
            "OpenCV: a matrix without dt",
            lambda t: t.replace("dt: d", "", 1),
            Right(refusal=r"camera_matrix|dt|matrix"),
        ),
        ("OpenCV: matrices as ROS writes them", _ros, Right(refusal=r"ROS|opencv-matrix|matrix")),
        (
            "OpenCV: left and right under other names",
            lambda t: re.sub(r"(?m)^right:", "cam1:", t),
            Right(refusal=r"right.*missing"),
        ),
        ("OpenCV: the left camera twice", _opencv_left_twice, Right(refusal=r"baseline|position|same")),
        ("OpenCV: skew", _matrices("camera_matrix", lambda k: [k[0], 4.0, *k[2:]]), Right(refusal=r"skew")),
    )
    for name, edit, right in cases:
        yield _text(name, "opencv", edit, right)


def _opencv_parts() -> Iterator[Slip]:
    def make(folder: Path) -> Sequence[object]:
        _write_stereo_parts(folder, rig())
        return [
            folder / "intrinsics.yml",
            "--from",
            "opencv",
            "--image-size",
            "568x416",
            "--out",
            folder / "out.json",
        ]

    def read(answer: Answer) -> bool:
        return "baseline 421." in answer.message or "baseline 422." in answer.message

    right = Right(sound=read)
    yield Slip("OpenCV: intrinsics.yml with extrinsics.yml", "camera file", "D1 rig", "convert", right, make)


def _thesis() -> Iterator[Slip]:
    packed = Right(refusal=r"DDDMMSS|decimal|degrees|angle")
    cases: tuple[tuple[str, Edit, Right], ...] = (
        (
            "1995: decimal degrees",
            _angles_1995(lambda side: [f"{a:.4f}" for a in rig()[side]["rotation_deg"]]),
            packed,
        ),
        (
            "1995: whole degrees",
            _angles_1995(lambda side: [f"{a:.0f}" for a in rig()[side]["rotation_deg"]]),
            packed,
        ),
        (
            "1995: radians",
            _angles_1995(lambda side: [f"{np.radians(a):.6f}" for a in rig()[side]["rotation_deg"]]),
            packed,
        ),
        (
            "1995: degrees and minutes",
            _angles_1995(lambda side: [_degrees_minutes(a) for a in rig()[side]["rotation_deg"]]),
            packed,
        ),
        ("1995: minutes above 59", _angles_1995(lambda side: ["-57509.0", "-165732.2", "12336.1"]), packed),
        (
            "1995: lines exchanged",
            lambda t: (
                t.replace("LEFT ", "#")
                .replace("RIGHT", "LEFT ")
                .replace("#", "RIGHT ", 2)
                .replace("RIGHT  X0", "# X0")
            ),
            Right(refusal=r"exchange|swap|left|LEFT"),
        ),
        (
            "1995: decimal commas",
            lambda t: re.sub(r"(\d)\.(\d)", r"\1,\2", t),
            Right(refusal=r"number|comma"),
        ),
        (
            "1995: K1 in place of f",
            _words_1995(lambda w: [*w[:6], w[9], *w[7:9], w[6], *w[10:]]),
            Right(refusal=r"\bf\b|focal|K1|distortion"),
        ),
    )
    for name, edit, right in cases:
        yield _text(name, "1995", edit, right)


def _openptv() -> Iterator[Slip]:
    angle = Right(refusal=r"angle|radian|degrees|rotation|omega")
    cases: tuple[tuple[str, Callable[[Path], object], Right], ...] = (
        (
            "OpenPTV: angles in degrees",
            _ori(lambda w: [*w[:3], *(_degrees(a) for a in w[_ANGLES]), *w[6:]]),
            angle,
        ),
        (
            "OpenPTV: angles and matrix contradict each other",
            _ori(lambda w: [*w[:3], w[3], str(float(w[4]) + 0.2), *w[5:]]),
            Right(refusal=r"matri|contradict", warning=r"matri|contradict"),
        ),
        (
            "OpenPTV: matrix of another camera",
            _ori(lambda w: [*w[:6], *"100010001", *w[15:]]),
            Right(refusal=r"matri|contradict", warning=r"matri|contradict"),
        ),
        ("OpenPTV: left and right files exchanged", _files_exchanged, Right(refusal=r"exchange|swap|left")),
        (
            "OpenPTV: positions in metres",
            _ori(lambda w: [*(str(float(v) / 1000) for v in w[:3]), *w[3:]]),
            Right(refusal=r"position|baseline|metre"),
        ),
        (
            "OpenPTV: a glass wall",
            _ori(lambda w: [*w[:-3], "0.0", "0.0", "120.0"]),
            Right(refusal=r"glass|refract", warning=r"glass|refract"),
        ),
        (
            "OpenPTV: distortion of another lens",
            _addpar("-0.02 0 0 0 0 1 0"),
            Right(refusal=r"distortion|carried|px"),
        ),
        ("OpenPTV: scale 0", _addpar("0.003 0 0 0 0 0 0"), Right(refusal=r"scale|distortion|addpar")),
    )
    for name, edit, right in cases:
        yield Slip(name, "camera file", "D1 rig", "convert", right, _openptv_maker(edit))
    bare = Right(refusal=r"glass|numbers|ori")
    short = _ori(lambda w: w[:-3])
    yield Slip("OpenPTV: no glass vector", "camera file", "D1 rig", "convert", bare, _openptv_maker(short))


def _json() -> Iterator[Slip]:
    plain = json.dumps(rig(), indent=1)
    twice = plain.replace('"focal_length_mm": 7.776', '"focal_length_mm": 7.776, "focal_length_mm": 9.2', 1)
    key = Right(refusal=r"focal_length_mm.*twice|twice.*focal_length_mm")
    yield _json_text("JSON: a key twice", twice, key)
    sides = plain.replace('"right":', '"left":', 1)
    yield _json_text("JSON: left twice, no right", sides, Right(refusal=r"twice|right.*missing"))
    huge = plain.replace("7.776", "1" + "0" * 400, 1)
    yield _json_text("JSON: an integer of 400 digits", huge, Right(refusal=r"focal_length_mm|finite|number"))
    yield _json_text(
        "JSON: an integer of 5000 digits",
        plain.replace("7.776", "7" * 5000, 1),
        Right(refusal=r"focal|finite|number|JSON"),
    )
    yield _json_text(
        "JSON: a byte-order mark", "\ufeff" + plain, Right(sound=lambda a: "baseline 421.9" in a.message)
    )
    yield _json_text("JSON: NaN", plain.replace("0.0029", "NaN", 1), Right(refusal=r"finite|JSON"))
    field = Right(refusal=r"rotation_deg")
    yield _json_text(
        "JSON: angles in DDDMMSS", json.dumps(changed_rig(each_camera("rotation_deg", _packed))), field
    )
    centre = Right(refusal=r"principal_point_mm")
    pixels = changed_rig(each_camera("principal_point_mm", lambda _: [290.0, 198.0]))
    yield _json_text("JSON: principal point in pixels", json.dumps(pixels), centre)


def _text(name: str, form: str, edit: Edit, right: Right) -> Slip:
    """Return the slip of the sample's rig, written in another form by ``convert`` itself and edited then."""

    def make(folder: Path) -> Sequence[object]:
        path = folder / f"rig.{form}"
        _convert(folder, path, form)
        path.write_text(edit(path.read_text()))
        return [path, "--from", form, "--out", folder / "out.json"]

    return Slip(name, "camera file", "D1 rig", "convert", right, make)


def _openptv_maker(edit: Callable[[Path], object]) -> Callable[[Path], Sequence[object]]:
    def make(folder: Path) -> Sequence[object]:
        _convert(folder, folder, "openptv")
        edit(folder)
        return [folder, "--from", "openptv", "--out", folder / "out.json"]

    return make


def _json_text(name: str, text: str, right: Right) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        path = folder / "rig.json"
        path.write_text(text)
        return [path, "--out", folder / "out.json"]

    return Slip(name, "camera file", "D1 rig", "convert", right, make)


def _convert(folder: Path, target: Path, form: str) -> None:
    source = write_rig(folder, rig())
    done = run_command("convert", [source, "--to", form, "--out", target])
    if done.status != 0:
        raise RuntimeError(f"the sound rig was not written as {form}: {done.message}")


def _matrices(key: str, change: Callable[[list[float]], Sequence[float]]) -> Edit:
    """Return an edit of the numbers of one matrix in both cameras."""
    pattern = re.compile(rf"({key}:.*?data:\s*\[)(.*?)(\])", re.DOTALL)

    def edit(match: re.Match[str]) -> str:
        numbers = [float(word) for word in match[2].split(",")]
        return match[1] + ", ".join(repr(float(v)) for v in change(numbers)) + match[3]

    return lambda text: pattern.sub(edit, text)


def _transposed(values: list[float]) -> list[float]:
    return [float(v) for v in np.array(values).reshape(3, 3).T.ravel()]


def _camera_in_space(text: str) -> str:
    positions = iter([rig()[side]["position_mm"] for side in SIDES])
    text = _matrices("rotation_matrix", _transposed)(text)
    return _matrices("translation_vector", lambda _: next(positions))(text)


def _eight(text: str) -> str:
    text = re.sub(r"(distortion_coefficients:.*?rows: )\d+", r"\g<1>8", text, flags=re.DOTALL)
    return _matrices("distortion_coefficients", lambda _: [9.2, 4.1, 0, 0, 0.2, 9.6, 7.0, 1.1])(text)


def _fisheye(text: str) -> str:
    text = re.sub(r"(distortion_coefficients:.*?rows: )\d+", r"\g<1>4", text, flags=re.DOTALL)
    text = _matrices("distortion_coefficients", lambda _: [-0.012, 0.031, -0.044, 0.018])(text)
    return re.sub(r"(?m)^( +)image_width:", r"\1distortion_model: fisheye\n\1image_width:", text)


def _short_matrix(text: str) -> str:
    return _matrices("camera_matrix", lambda k: k[:8])(text)


def _ros(text: str) -> str:
    return re.sub(r" *dt: d\n", "", text.replace("!!opencv-matrix", ""))


def _opencv_left_twice(text: str) -> str:
    start, end = re.search(r"(?m)^left:", text), re.search(r"(?m)^right:", text)
    assert start is not None  # noqa: S101 - convert wrote it
    assert end is not None  # noqa: S101
    left = text[start.end() : end.start()]
    return text[: end.end()] + left


def _write_stereo_parts(folder: Path, document: RigJson) -> None:
    """Write what OpenCV's sample stereo_calib.cpp writes: M1, D1, M2, D2; and R, T from left to right, mm.

    The distortion is left at zero here.
    """
    matrices, poses = [], []
    for side in SIDES:
        camera = camera_of(document[side])
        px, py = camera.pixel_size_mm
        cx, cy = camera.pixels(camera.principal_point_mm)
        matrices.append(
            np.array([[camera.focal_length_mm / px, 0, cx], [0, camera.focal_length_mm / py, cy], [0, 0, 1]])
        )
        R = np.diag([1.0, -1.0, -1.0]) @ camera.M
        poses.append((R, -R @ camera.centre))
    R = poses[1][0] @ poses[0][0].T
    T = poses[1][1] - R @ poses[0][1]
    parts = {
        "intrinsics.yml": {
            "M1": matrices[0],
            "D1": np.zeros((1, 5)),
            "M2": matrices[1],
            "D2": np.zeros((1, 5)),
        },
        "extrinsics.yml": {"R": R, "T": T[:, None]},
    }
    for name, entries in parts.items():
        file = cv2.FileStorage(name, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
        for key, value in entries.items():
            file.write(key, value)
        (folder / name).write_text(file.releaseAndGetString())


def _words_1995(change: Callable[[list[str]], list[str]]) -> Edit:
    def edit(text: str) -> str:
        lines = [line.split() for line in text.splitlines() if not line.startswith("#")]
        return "".join(" ".join([side, *change(words)]) + "\n" for side, *words in lines)

    return edit


def _angles_1995(angles: Callable[[str], list[str]]) -> Edit:
    def edit(text: str) -> str:
        lines = [line.split() for line in text.splitlines() if not line.startswith("#")]
        changed = [[side, *words[:3], *angles(side.lower()), *words[6:]] for side, *words in lines]
        return "".join(" ".join(words) + "\n" for words in changed)

    return edit


def _degrees_minutes(angle: float) -> str:
    degrees, minutes = divmod(abs(angle) * 60, 60)
    return f"{'-' if angle < 0 else ''}{degrees:.0f}{minutes:02.0f}"


def _packed(angles: list[float]) -> list[float]:
    out = []
    for angle in angles:
        degrees, rest = divmod(abs(angle), 1)
        minutes, rest = divmod(60 * rest, 1)
        out.append(float(np.copysign(10000 * degrees + 100 * minutes + 60 * rest, angle)))
    return out


def _degrees(radians: str) -> str:
    return f"{np.degrees(float(radians)):.6f}"


def _ori(change: Callable[[list[str]], list[str]]) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        for side in SIDES:
            path = folder / f"{side}.ori"
            path.write_text(" ".join(change(path.read_text().split())) + "\n")

    return edit


def _addpar(text: str) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        for side in SIDES:
            (folder / f"{side}.addpar").write_text(text + "\n")

    return edit


def _files_exchanged(folder: Path) -> None:
    for suffix in ("ori", "addpar"):
        left, right = folder / f"left.{suffix}", folder / f"right.{suffix}"
        text = left.read_text()
        left.write_text(right.read_text())
        right.write_text(text)
