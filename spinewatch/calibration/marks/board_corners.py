"""Inner corners of a chessboard or ChArUco board in images, by OpenCV's detectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float, Int, Pixels
from spinewatch.calibration.boards import BoardField, Charuco, Chessboard, rotated
from spinewatch.calibration.errors import IdentificationError, TargetsNotFoundError
from spinewatch.calibration.points import ImagePoints, Shot
from spinewatch.imaging.frame import SIDES

_Gray = NDArray[np.uint8]
_SECTOR_FLAGS = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
_QUAD_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
_REFINEMENT = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-4)


@dataclass(frozen=True)
class BoardCornerParameters:
    """How the corners of boards are found.

    Attributes
    ----------
    max_width_px
        Width to which larger images are reduced before detection, px; corners are then refined in the image itself.
        The time of OpenCV's detector in an image without a board grows with its area: 30 s for 12 million pixels.
    refinement_window
        Half width of the window in which a corner is refined, as a fraction of the least distance of corners.
    min_corners
        Fewest corners of a partly hidden ChArUco board.
    min_angle_gap_deg
        Least difference between the rotation of a chessboard from the left to the right image and that of its second
        possible identification, degrees.
    """

    max_width_px: int = 1600
    refinement_window: float = 0.25
    min_corners: int = 12
    min_angle_gap_deg: float = 40.0


def upright_shots(shots: Sequence[Shot], field: BoardField) -> tuple[BoardField, list[Shot]]:
    """Return field and shots in the frame in which X runs to the right in the first left image.

    Parameters
    ----------
    shots
        Image points of each shot, with the coordinates of the field.
    field
        The board.

    Returns
    -------
    field : BoardField
        The rotated board.
    shots : list of Shot
        The same image points with its coordinates.

    Examples
    --------
    >>> from spinewatch.calibration.boards import board_field
    >>> field = board_field("chessboard:9x6:25")
    >>> u = field.points_mm[:, [1, 0]]  # X runs down in the image
    >>> image = ImagePoints.build(field.ids, field.points_mm, u)
    >>> upright_shots([Shot("1", image, image)], field)[0].take(["1", "9"]).tolist()
    [[125.0, 200.0, 0.0], [125.0, 0.0, 0.0]]
    """
    first = shots[0].left
    quarter_turns = round(_angle_deg(first.control_mm, first.pixels) / 90)
    upright = rotated(field, quarter_turns)

    def turned(image: ImagePoints) -> ImagePoints:
        return ImagePoints.build(image.ids, upright.take(image.ids), image.pixels)

    return upright, [Shot(shot.name, turned(shot.left), turned(shot.right)) for shot in shots]


def find_corners(
    pair: tuple[Pixels, Pixels], name: str, field: BoardField, parameters: BoardCornerParameters
) -> Shot:
    """Return the corners of a board in both images of a shot.

    A chessboard looks the same after a rotation by 180 degrees, up to its colours when one of its numbers of inner
    corners is odd and the other even. In the left image any of the possible identifications will do. In the right image
    it is the one with the same colours and the least rotation from the left image.

    Parameters
    ----------
    pair
        Left and right image, shape (H, W), gray.
    name
        Name of the shot, for error messages.
    field
        The board.
    parameters
        How corners are found.

    Returns
    -------
    Shot
        Identified corners.

    Raises
    ------
    TargetsNotFoundError
        If an image does not show the board.
    IdentificationError
        If two identifications are similarly probable.

    References
    ----------
    A. Duda, U. Frese, "Accurate detection and localization of checkerboard corners for calibration", BMVC 2018. S.
    Garrido-Jurado et al., "Automatic generation and detection of highly reliable fiducial markers", Pattern Recognition
    47 (2014) 2280-2292.
    """
    labels = [f"the {side} image of shot {name}" for side in SIDES]
    left, right = (_gray(image) for image in pair)
    if isinstance(field.board, Charuco):
        images = [
            _charuco_points(image, field, field.board, where, parameters)
            for image, where in zip((left, right), labels, strict=True)
        ]
        return Shot(name, *images)
    grids = [
        _chessboard_grid(image, field.board, where, parameters)
        for image, where in zip((left, right), labels, strict=True)
    ]
    right_grid = _same_orientation((left, right), (grids[0], grids[1]), labels[1], parameters)
    return Shot(name, _grid_points(grids[0], field), _grid_points(right_grid, field))


def _chessboard_grid(image: _Gray, board: Chessboard, where: str, parameters: BoardCornerParameters) -> Float:
    """Return the corners (rows, columns, 2), not mirrored and with X to the right as far as the board permits."""
    small, scale = _reduced(image, parameters)
    size = (board.columns, board.rows)
    found, corners = cv2.findChessboardCornersSB(small, size, flags=_SECTOR_FLAGS)
    if not found:  # it misses boards near the border that the older detector finds
        found, corners = cv2.findChessboardCorners(small, size, flags=_QUAD_FLAGS)
    if not found:
        raise TargetsNotFoundError(
            f"{where}: no chessboard of {board.columns} x {board.rows} inner corners is in view; show all of it with a"
            " white border, and check the numbers, which are of inner corners and not of squares"
        )
    near = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    pixels = _refined(image, near, scale, parameters.refinement_window)
    grid = pixels.reshape(board.rows, board.columns, 2)
    along, across = grid[:, -1] - grid[:, 0], grid[-1] - grid[0]
    if np.cross(np.append(along.sum(axis=0), 0.0), np.append(across.sum(axis=0), 0.0))[2] < 0:
        grid = grid[::-1]
    return min(_rotations(grid), key=lambda g: abs(_grid_angle_deg(g)))


def _same_orientation(
    images: tuple[_Gray, _Gray], grids: tuple[Float, Float], where: str, parameters: BoardCornerParameters
) -> Float:
    """Return the right grid in the rotation that corresponds to the left one."""
    left, right = grids
    colours, angle = _colours(images[0], left), _grid_angle_deg(left)
    candidates = [g for g in _rotations(right) if _colours(images[1], g) == colours]
    rotations = [abs((_grid_angle_deg(g) - angle + 180) % 360 - 180) for g in candidates]
    order = np.argsort(rotations)
    if not candidates:
        raise IdentificationError(
            f"{where}: the colours of the squares are not those of the left image; give the pair of two cameras"
        )
    if len(order) > 1 and rotations[order[1]] - rotations[order[0]] < parameters.min_angle_gap_deg:
        raise IdentificationError(
            f"{where}: the chessboard is rotated by {rotations[order[0]]:.0f} or {rotations[order[1]]:.0f} degrees from"
            " the left image, which looks the same; use a board with an odd and an even number of inner corners, or a"
            " ChArUco board"
        )
    return candidates[int(order[0])]


def _rotations(grid: Float) -> list[Float]:
    """Return the rotations of a grid (rows, columns, 2) that have its shape."""
    half = grid[::-1, ::-1]
    if grid.shape[0] != grid.shape[1]:
        return [grid, half]
    quarter = np.swapaxes(grid, 0, 1)[::-1]
    return [grid, quarter, half, quarter[::-1, ::-1]]


def _grid_angle_deg(grid: Float) -> float:
    """Return the direction of a grid's rows in the image, degrees, counterclockwise from the right."""
    u, v = (grid[:, -1] - grid[:, 0]).sum(axis=0)
    return float(np.degrees(np.arctan2(-v, u)))


def _colours(image: _Gray, grid: Float) -> bool:
    """Return whether the first square inside a grid is brighter than its neighbours."""
    centres = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    at = np.round(centres).astype(int)
    levels = image[
        np.clip(at[..., 1], 0, image.shape[0] - 1), np.clip(at[..., 0], 0, image.shape[1] - 1)
    ].astype(np.float64)
    r, c = np.indices(levels.shape)
    return bool(np.sum((levels - levels.mean()) * np.where((r + c) % 2 == 0, 1, -1)) > 0)


def _grid_points(grid: Float, field: BoardField) -> ImagePoints:
    return ImagePoints.build(field.ids, field.points_mm, grid.reshape(-1, 2))


def _charuco_points(
    image: _Gray, field: BoardField, board: Charuco, where: str, parameters: BoardCornerParameters
) -> ImagePoints:
    """Return the identified corners of a ChArUco board, printed by OpenCV 4.6 or later, or by an older one."""
    small, scale = _reduced(image, parameters)
    best: tuple[Float, Int] = (np.empty((0, 2)), np.empty(0, dtype=np.intp))
    for legacy in (False, True):
        pattern = cv2.aruco.CharucoBoard(
            (board.columns + 1, board.rows + 1),
            board.square_mm,
            board.marker_mm,
            cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary)),
        )
        pattern.setLegacyPattern(legacy)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(pattern).detectBoard(small)
        if ids is not None and len(ids) > len(best[1]):
            best = (
                np.asarray(corners, dtype=np.float64).reshape(-1, 2),
                np.asarray(ids).ravel().astype(np.intp),
            )
    corners, ids = best
    if len(ids) < min(parameters.min_corners, len(field)) or _on_one_line(field.points_mm[ids]):
        raise TargetsNotFoundError(
            f"{where}: {len(ids)} of {len(field)} corners of the ChArUco board were found; show more of the board, and"
            " check the numbers of squares, the sizes and the dictionary"
        )
    if scale < 1.0:  # else OpenCV has refined them
        free = (board.square_mm - board.marker_mm) / board.square_mm / 2
        corners = _refined(image, corners, scale, min(parameters.refinement_window, free))
    return ImagePoints.build([field.ids[i] for i in ids], field.points_mm[ids], corners)


def _on_one_line(points_mm: Float) -> bool:
    return bool(np.any(np.ptp(points_mm[:, :2], axis=0) == 0))


def _angle_deg(control_mm: Float, pixels: Float) -> float:
    """Return the direction of the board's X in an image, degrees, counterclockwise from the right."""
    H, _ = cv2.findHomography(control_mm[:, :2], pixels)
    middle = np.append(control_mm[:, :2].mean(axis=0), 1.0)
    p = H @ middle
    u, v = (H[:2, 0] * p[2] - p[:2] * H[2, 0]) / p[2] ** 2
    return float(np.degrees(np.arctan2(-v, u)))


def _gray(image: Pixels) -> _Gray:
    """Return an image of 8 bits; 16 bits are scaled to its own brightest pixel."""
    if image.dtype == np.uint8:
        return np.asarray(image, dtype=np.uint8)
    brightest = max(int(image.max()), 1)
    return np.round(image * (255.0 / brightest)).astype(np.uint8)


def _reduced(image: _Gray, parameters: BoardCornerParameters) -> tuple[_Gray, float]:
    scale = min(1.0, parameters.max_width_px / max(image.shape))
    if scale == 1.0:
        return image, scale
    size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8), scale


def _refined(image: _Gray, corners: Float, scale: float, window: float) -> Float:
    """Return corners (n, 2) of the reduced image refined in the image, in windows of a fraction of their distance."""
    near = np.ascontiguousarray((corners + 0.5) / scale - 0.5, dtype=np.float32)
    d = np.linalg.norm(near[:, None] - near[None], axis=2)
    np.fill_diagonal(d, np.inf)
    half = max(2, int(window * d.min()))
    fine = cv2.cornerSubPix(image, near.reshape(-1, 1, 2), (half, half), (-1, -1), _REFINEMENT)
    return np.asarray(fine, dtype=np.float64).reshape(-1, 2)
