"""Transforms for 3D Slicer: a ZIP archive of ITK transform files (.tfm), per stage and vertebra.

``STAGE/LEVEL-pose.tfm`` puts a model of a vertebra in its place: from the vertebra's own axes (left, posterior,
superior; origin at the centroid) to the spine's frame. ``STAGE/LEVEL-motion.tfm`` moves a model that was placed as of
the baseline stage to where the vertebra is at this stage.

ITK files hold the transform that maps points of the parent to points of the child, in LPS and mm. Slicer inverts it and
changes to RAS when it reads the file, so that its "transform to parent" is the motion itself. ``transforms.json`` gives
the same transforms as matrices to the parent, with origins, deviations and the frame.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from contract.spine import StageSpine, VertebraChange, VertebraState
from contract.summary import SurgerySummary
from exports.archive import zip_archive
from exports.coordinates import LPS_FROM_PATIENT, inverse, transform
from exports.selection import no_spine_reason, selected_stages
from exports.text import single_line
from spinewatch.arrays import Float

MEDIA_TYPE = "application/zip"
FILE_SUFFIX = ".transforms.zip"

_HEADER = "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
_CONVENTION = (
    "matrix_to_parent maps points of the vertebra (pose) or of the baseline stage (motion) to the spine's frame, LPS,"
    " mm; the .tfm file holds its inverse, as ITK does"
)


def export(summary: SurgerySummary, stage: str | None = None) -> bytes:
    """Return the transforms of a surgery.

    Parameters
    ----------
    summary
        The surgery with all its stages.
    stage
        Name of one stage; None for all.

    Returns
    -------
    bytes
        ZIP archive; a vertebra without a pose or a motion, and a stage without a spine, have no file and are listed
        with their reason.

    Raises
    ------
    UnknownStageError
        If the surgery has no stage of that name.
    """
    files: dict[str, bytes] = {}
    entries: list[dict[str, Any]] = []
    without_spine: list[dict[str, Any]] = []
    for found in selected_stages(summary, stage):
        if found.spine is None:
            without_spine.append(
                {"stage": found.name, "take": found.take, "reason": single_line(no_spine_reason(found))}
            )
            continue
        for entry, matrix in _of_stage(found.spine):
            entries.append(entry)
            if matrix is not None:
                files[entry["file"]] = transform_file(matrix)
    index = {
        "surgery_id": summary.surgery_id,
        "coordinate_system": "LPS",
        "unit": "mm",
        "convention": _CONVENTION,
        "version": summary.version,
        "transforms": entries,
        "stages_without_spine": without_spine,
    }
    document = json.dumps(index, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    return zip_archive({"transforms.json": document.encode(), **files})


def transform_file(matrix_to_parent: Float) -> bytes:
    """Return an ITK transform file.

    Parameters
    ----------
    matrix_to_parent
        Homogeneous matrix of a rigid transform in LPS, shape (4, 4), mm, that maps points to the parent.

    Returns
    -------
    bytes
        The file; its transform maps points from the parent.

    Examples
    --------
    >>> shift = np.eye(4)
    >>> shift[0, 3] = 5.0
    >>> print(transform_file(shift).decode().splitlines()[3])
    Parameters: 1.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0 -5.0 0.0 0.0
    """
    from_parent = inverse(matrix_to_parent)
    numbers = [*from_parent[:3, :3].ravel().tolist(), *from_parent[:3, 3].tolist()]
    parameters = " ".join(repr(number + 0.0) for number in numbers)  # + 0.0 turns -0.0 into 0.0
    return f"{_HEADER}Parameters: {parameters}\nFixedParameters: 0.0 0.0 0.0\n".encode()


def _of_stage(spine: StageSpine) -> Iterator[tuple[dict[str, Any], Float | None]]:
    for state in spine.vertebrae:
        yield _entry(spine, state, "pose", _pose(state))
    if spine.since_baseline is not None:
        places = {state.vertebra: state for state in spine.vertebrae}
        for change in spine.since_baseline.vertebrae:
            motion = _motion(places.get(change.vertebra), change)
            yield _entry(spine, change, f"motion since {spine.since_baseline.since.name}", motion)


def _pose(state: VertebraState) -> Float | None:
    if state.position_mm is None:
        return None
    return transform(LPS_FROM_PATIENT, np.array(state.rotation), np.array(state.position_mm))


def _motion(after: VertebraState | None, change: VertebraChange) -> Float | None:
    """Return the motion as a transform of space: it turns about where the centroid was, not about the origin."""
    displacement = [value for value in change.translation_mm if value is not None]
    if after is None or after.position_mm is None or change.rotation is None or len(displacement) != 3:
        return None
    R = np.array(change.rotation)
    now = np.array(after.position_mm)
    before = now - displacement
    return transform(LPS_FROM_PATIENT, R, now - R @ before)


def _entry(
    spine: StageSpine, vertebra: VertebraState | VertebraChange, kind: str, matrix: Float | None
) -> tuple[dict[str, Any], Float | None]:
    entry: dict[str, Any] = {
        "stage": spine.stage,
        "take": spine.take,
        "vertebra": vertebra.vertebra,
        "kind": kind,
        "frame": spine.frame,
        "origin": vertebra.origin.value,
        "reason": _reason(vertebra),
        **_deviations(vertebra),
    }
    if matrix is None:
        return {**entry, "file": None, "matrix_to_parent": None}, None
    path = f"{spine.stage}/{vertebra.vertebra}-{kind.partition(' ')[0]}.tfm"
    return {**entry, "file": path, "matrix_to_parent": matrix.tolist()}, matrix


def _reason(vertebra: VertebraState | VertebraChange) -> str | None:
    """Return why there is no pose or motion, or why a pose has a position without an error."""
    return vertebra.reason or (vertebra.position_reason if isinstance(vertebra, VertebraState) else None)


def _deviations(vertebra: VertebraState | VertebraChange) -> Mapping[str, Any]:
    """Return the deviations as stored: (anterior, left, cephalad)."""
    if isinstance(vertebra, VertebraState):
        return {"position_sd_mm": vertebra.position_sd_mm, "rotation_sd_deg": vertebra.rotation_sd_deg}
    return {"translation_sd_mm": vertebra.translation_sd_mm, "rotation_sd_deg": vertebra.rotation_sd_deg}
