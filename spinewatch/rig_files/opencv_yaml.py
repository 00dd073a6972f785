"""A rig in the YAML of OpenCV's FileStorage, in one of two forms.

One file with both cameras, with the names of OpenCV's calibration sample, which is what is written:

    left: { image_width, image_height, camera_matrix, distortion_coefficients, rotation_matrix, translation_vector }
    right: ...

``R X + t`` maps object space to camera axes (x right, y down, z forward), mm.

Or what OpenCV's stereo_calib.cpp writes: intrinsics.yml with M1, D1, M2, D2, and extrinsics.yml with R, T from left to
right camera axes, mm; all may be in one file. It does not contain the image size. Object space is then that of the left
camera, X to the right, Y up, Z towards the cameras.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2
import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.errors import RigError
from spinewatch.rig_files.opencv_camera import from_opencv, to_opencv
from spinewatch.rig_plausibility import SIDES

_MATRICES = ("camera_matrix", "distortion_coefficients", "rotation_matrix", "translation_vector")
_INTRINSICS = {"left": ("M1", "D1"), "right": ("M2", "D2")}
_STANDARD_MODELS = frozenset({"plumb_bob", "rational_polynomial", "pinhole", "opencv", "radtan", "standard"})
_HEADER = "%YAML:1.0\n---\n"
_NO = frozenset({"", "0", "false", "no", "none"})
_LEFT_ROTATION = np.diag([1.0, -1.0, -1.0])


def format_opencv(rig: Rig) -> tuple[str, float]:
    """Return the YAML text of a rig.

    Parameters
    ----------
    rig
        The rig.

    Returns
    -------
    text : str
        The YAML.
    fit_error_px : float
        Maximum error of the fitted distortion over both images, px.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> text, _ = format_opencv(large_rig())
    >>> rig, _ = parse_opencv(text, "again")
    >>> round(rig.baseline_mm, 6)
    420.0
    """
    file = cv2.FileStorage("rig.yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    errors = []
    for side in SIDES:
        camera = to_opencv(getattr(rig, side))
        errors.append(camera.fit_error_px)
        file.startWriteStruct(side, cv2.FileNode_MAP)
        file.write("image_width", camera.image_size_px[0])
        file.write("image_height", camera.image_size_px[1])
        for name, value in zip(_MATRICES, (camera.K, camera.dist, camera.R, camera.t), strict=True):
            file.write(name, value.reshape(value.shape[0], -1))
        file.endWriteStruct()
    return file.releaseAndGetString(), max(errors)


def parse_opencv(
    text: str,
    name: str,
    pixel_width_mm: float = 0.01,
    *,
    extrinsics: str | None = None,
    image_size_px: tuple[int, int] | None = None,
) -> tuple[Rig, float]:
    """Return the rig of a YAML text.

    Parameters
    ----------
    text
        The YAML.
    name
        Name of the rig.
    pixel_width_mm
        Width of a pixel on the plate, mm, which is not part of OpenCV's model.
    extrinsics
        The YAML with R and T, if `text` has the form of intrinsics.yml.
    image_size_px
        (W, H), px, for that form.

    Returns
    -------
    rig : Rig
        The rig.
    fit_error_px : float
        Maximum error of the fitted distortion over both images, px.

    Raises
    ------
    RigError
        If the text is not such a file; names the field that is wrong.
    """
    file = _opened(text)  # nodes are views of the file, which must stay open
    _check_model(file.root())
    if file.getNode("M1").empty():
        cameras = [_camera(file, side, pixel_width_mm) for side in SIDES]
    else:
        pose = file if extrinsics is None or not file.getNode("R").empty() else _opened(extrinsics)
        cameras = list(_stereo(file, pose, image_size_px, pixel_width_mm))
    (left, left_px), (right, right_px) = cameras
    return Rig(name, left, right), max(left_px, right_px)


def _opened(text: str) -> cv2.FileStorage:
    """Return a YAML text, with or without its first line, as a file that is open for reading."""
    if not text.lstrip().startswith(("%YAML", "<?xml", "{")):
        text = _HEADER + text
    try:
        file = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    except (cv2.error, SystemError) as error:
        raise RigError(
            "(document)", "is not in the format of OpenCV's FileStorage; export the rig again"
        ) from error
    if not file.isOpened() or not file.root().isMap():
        raise RigError("(document)", "is not in the format of OpenCV's FileStorage; export the rig again")
    return file


def _check_model(root: cv2.FileNode) -> None:
    """Raise RigError for a distortion model other than OpenCV's standard one."""
    for path, node in _entries(root):
        key = path.rpartition(".")[2].lower()
        value = _word(node)
        fisheye = "fisheye" in key and value not in _NO
        if fisheye or (key.endswith("model") and "fisheye" not in key and value not in _STANDARD_MODELS):
            raise RigError(
                path,
                f"is {value or 'given'}: only OpenCV's standard distortion model is read, not fisheye or other models;"
                " calibrate with calibrateCamera",
            )


def _entries(node: cv2.FileNode, path: str = "") -> Iterator[tuple[str, cv2.FileNode]]:
    """Yield all named nodes of a document with their paths, at most two levels deep."""
    for key in node.keys():  # noqa: SIM118 - a FileNode is not a dict
        entry = node.getNode(key)
        yield f"{path}{key}", entry
        if entry.isMap() and not path:
            yield from _entries(entry, f"{key}.")


def _word(node: cv2.FileNode) -> str:
    """Return the text or number of a node in lower case."""
    if node.isString():
        return str(node.string()).strip().lower()
    return f"{node.real():g}" if node.isInt() or node.isReal() else ""


def _camera(file: cv2.FileStorage, side: str, pixel_width_mm: float) -> tuple[Camera, float]:
    """Return one camera of the form with left and right, and the error of its distortion, px."""
    node = file.getNode(side)
    if not node.isMap():
        raise RigError(
            side,
            "is missing; a rig has a left and a right camera, or M1, D1, M2, D2 with R, T as OpenCV's stereo_calib",
        )
    size = [node.getNode(key).real() for key in ("image_width", "image_height")]
    if not all(1 <= n <= 1e6 and n == int(n) for n in size):
        raise RigError(f"{side}.image_width, image_height", "must be positive whole numbers")
    fields = [f"{side}.{key}" for key in _MATRICES]
    K, dist, R, t = (_matrix(node.getNode(key), f) for key, f in zip(_MATRICES, fields, strict=True))
    return _converted((K, dist, R, t), fields, (int(size[0]), int(size[1])), pixel_width_mm)


def _stereo(
    file: cv2.FileStorage, pose: cv2.FileStorage, size: tuple[int, int] | None, pixel_width_mm: float
) -> Iterator[tuple[Camera, float]]:
    """Yield both cameras of the form of stereo_calib.cpp, with the errors of their distortion, px."""
    if size is None:
        raise RigError("M1", "comes without the image size; give --image-size, like 640x480")
    if pose.getNode("R").empty() or pose.getNode("T").empty():
        raise RigError("R, T", "are missing; put OpenCV's extrinsics.yml beside the file with M1, D1, M2, D2")
    R, T = _matrix(pose.getNode("R"), "R"), _matrix(pose.getNode("T"), "T")
    poses = {
        "left": (_LEFT_ROTATION, np.zeros((3, 1))),
        "right": (R @ _LEFT_ROTATION if R.shape == (3, 3) else R, T),
    }
    for side, (matrix, distortion) in _INTRINSICS.items():
        K, dist = (_matrix(file.getNode(key), key) for key in (matrix, distortion))
        yield _converted((K, dist, *poses[side]), [matrix, distortion, "R", "T"], size, pixel_width_mm)


def _converted(
    values: tuple[Float, Float, Float, Float],
    fields: Sequence[str],
    size: tuple[int, int],
    pixel_width_mm: float,
) -> tuple[Camera, float]:
    """Return the camera of (K, dist, R, t); errors name the fields of the file."""
    K, dist, R, t = values
    if t.size != 3:
        raise RigError(fields[3], f"has {t.size} numbers; a translation has 3")
    try:
        return from_opencv(K, R, t, dist, size, pixel_width_mm)
    except RigError as error:
        raise RigError(fields[("K", "dist", "R").index(error.field)], error.problem) from error


def _matrix(node: cv2.FileNode, field: str) -> Float:
    """Return a matrix of a document, shape (rows, cols)."""
    if not node.isMap() or not node.getNode("data").isSeq():
        raise RigError(field, "is missing or no matrix; write it as an opencv-matrix")
    if not node.getNode("dt").isString():
        raise RigError(
            field,
            "has no dt, the type of its elements, as ROS writes matrices; write it as an opencv-matrix with rows, cols,"
            " dt: d and data, in the form of docs/method.md",
        )
    data = node.getNode("data")
    entries = [data.at(k) for k in range(data.size())]
    if not all(entry.isReal() or entry.isInt() for entry in entries):
        raise RigError(field, "has an entry that is not a number")
    values = np.array([entry.real() for entry in entries])
    rows, cols = (int(node.getNode(key).real()) for key in ("rows", "cols"))
    if rows * cols != len(values) or min(rows, cols) < 1:
        raise RigError(field, f"has {len(values)} entries for {rows} x {cols}; export the matrix again")
    if not np.all(np.isfinite(values)):
        raise RigError(field, "must be finite")
    return values.reshape(rows, cols)
