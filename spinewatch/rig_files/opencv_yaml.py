"""A rig in the YAML of OpenCV's FileStorage, with the names of OpenCV's samples.

    left: { image_width, image_height, camera_matrix, distortion_coefficients, rotation_matrix, translation_vector }
    right: ...

``R X + t`` maps object space to camera axes (x right, y down, z forward), mm.
"""

from __future__ import annotations

import cv2
import numpy as np

from spinewatch.camera import Camera, Rig
from spinewatch.errors import RigError
from spinewatch.rig_files.opencv_camera import from_opencv, to_opencv

_SIDES = ("left", "right")
_MATRICES = ("camera_matrix", "distortion_coefficients", "rotation_matrix", "translation_vector")


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
    for side in _SIDES:
        camera = to_opencv(getattr(rig, side))
        errors.append(camera.fit_error_px)
        file.startWriteStruct(side, cv2.FileNode_MAP)
        file.write("image_width", camera.image_size_px[0])
        file.write("image_height", camera.image_size_px[1])
        for name, value in zip(_MATRICES, (camera.K, camera.dist, camera.R, camera.t), strict=True):
            file.write(name, value.reshape(value.shape[0], -1))
        file.endWriteStruct()
    return file.releaseAndGetString(), max(errors)


def parse_opencv(text: str, name: str, pixel_width_mm: float = 0.01) -> tuple[Rig, float]:
    """Return the rig of a YAML text.

    Parameters
    ----------
    text
        The YAML.
    name
        Name of the rig.
    pixel_width_mm
        Width of a pixel on the plate, mm, which is not part of OpenCV's model.

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
    try:
        file = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    except (cv2.error, SystemError) as error:
        raise RigError(
            "(document)", "is not in the format of OpenCV's FileStorage; export the rig again"
        ) from error
    cameras, errors = [], []
    for side in _SIDES:
        camera, error_px = _camera(file, side, pixel_width_mm)
        cameras.append(camera)
        errors.append(error_px)
    return Rig(name, cameras[0], cameras[1]), max(errors)


def _camera(file: cv2.FileStorage, side: str, pixel_width_mm: float) -> tuple[Camera, float]:
    node = file.getNode(side)
    if not node.isMap():
        raise RigError(side, "is missing; a rig has a left and a right camera")
    size = [node.getNode(key).real() for key in ("image_width", "image_height")]
    if not all(n >= 1 for n in size):
        raise RigError(f"{side}.image_width, image_height", "must be positive whole numbers")
    values = []
    for key in _MATRICES:
        entry = node.getNode(key)
        value = entry.mat() if entry.isMap() else None
        if value is None or not np.all(np.isfinite(value)):
            raise RigError(f"{side}.{key}", "is missing or not finite; write it as an opencv-matrix")
        values.append(np.asarray(value, dtype=np.float64))
    K, dist, R, t = values
    if t.size != 3 or dist.size not in {4, 5, 8, 12, 14}:
        raise RigError(
            f"{side}.translation_vector, distortion_coefficients", "have a wrong number of entries"
        )
    return from_opencv(K, R, t, dist, (int(size[0]), int(size[1])), pixel_width_mm)
