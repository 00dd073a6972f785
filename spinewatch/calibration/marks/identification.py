"""Identification of targets: the control point of each, for a board in any position, by hypothesis and test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice, product

import numpy as np

from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import (
    BoardOrientationError,
    CalibrationError,
    ConvergenceError,
    IdentificationError,
    MirroredFieldError,
    TargetsNotFoundError,
)
from spinewatch.calibration.marks.assignment import (
    Assignment,
    IdentificationTask,
    MarkIdentificationParameters,
    assign_with_lens,
    refine_assignment,
)
from spinewatch.calibration.marks.detection import Targets
from spinewatch.calibration.marks.pose_hypotheses import pose_hypotheses, seed_triples
from spinewatch.calibration.points import ImagePoints, Sensor
from spinewatch.camera import Camera

_OTHER_AXES: tuple[tuple[tuple[int, int, int], type[CalibrationError], str], ...] = (
    (
        (-1, 1, 1),
        MirroredFieldError,
        "mirrored: give right-handed coordinates, for which X and Y may be exchanged or pegs numbered from the wrong"
        " side, and do not flip the image",
    ),
    (
        (1, 1, -1),
        MirroredFieldError,
        "with the sign of every Z reversed; Z must point up to the cameras, and higher pegs have a larger z_mm",
    ),
    (
        (1, -1, -1),
        BoardOrientationError,
        "upside down; rotate its axes so that Z points up to the cameras, and higher pegs have a larger z_mm",
    ),
)
"""Signs of axes that are often wrong, and the error when the field fits with them."""


@dataclass(frozen=True, eq=False)
class IdentifiedTargets:
    """Identified targets of an image.

    Attributes
    ----------
    points
        The image points, in the order of the control field.
    camera
        The camera that fits them: initial value of the next shot.
    """

    points: ImagePoints
    camera: Camera


def identify_targets(
    targets: Targets,
    field: ControlField,
    sensor: Sensor,
    parameters: MarkIdentificationParameters | None = None,
    where: str = "the image",
    known: Camera | None = None,
) -> IdentifiedTargets:
    """Return the targets of an image that are control points.

    Three neighbouring targets are tried as all similar triples of neighbouring control points. Each gives a pose that
    predicts all other images. The poses that explain most targets are adjusted with the lens, and the assignment of
    most targets is selected. Targets that fit no control point are left out.

    Parameters
    ----------
    targets
        The targets.
    field
        The control field.
    sensor
        The sensor.
    parameters
        How to identify.
    where
        Name of the image in error messages.
    known
        Camera with the same interior orientation, if there is one.

    Returns
    -------
    IdentifiedTargets
        The image points and their camera.

    Raises
    ------
    TargetsNotFoundError
        If there are fewer than ``min_targets`` targets.
    IdentificationError
        If no assignment is significant, or two fit equally well.
    MirroredFieldError, BoardOrientationError
        If the field fits only with other axes.
    """
    parameters = parameters or MarkIdentificationParameters()
    if len(targets) < parameters.min_targets:
        raise TargetsNotFoundError(
            f"{where} shows {len(targets)} targets; at least {parameters.min_targets} are needed: light the board"
            " evenly, focus, and keep pegs from occluding each other"
        )
    task = IdentificationTask(targets.pixels, field, sensor.image_size_px[0], parameters)
    plate = float(sensor.plate_mm[0])
    lenses = [sensor.camera(focal_length_mm=width * plate) for width in parameters.focal_widths]
    try:
        found = _search(task, lenses if known is None else [known, *lenses])
    except IdentificationError as error:
        raise IdentificationError(f"{where}: {error}") from error
    if found is None:
        raise _diagnosis(task, lenses, where)
    order = np.argsort(found.control)
    target, control = found.target[order], found.control[order]
    ids = [field.ids[i] for i in control]
    points = ImagePoints.build(ids, field.points_mm[control], targets.pixels[target], targets.sd_px[target])
    return IdentifiedTargets(points, found.camera)


def _search(task: IdentificationTask, lenses: Sequence[Camera]) -> Assignment | None:
    """Return the assignment of most targets, or None; raise when it is ambiguous.

    The poses of the first seed and lens are adjusted alone; if they give no complete assignment, the best of all
    others follow.
    """
    parameters = task.parameters
    trials = product(islice(seed_triples(task.pixels, parameters), parameters.max_seeds), lenses)
    assignments: list[Assignment] = []
    for n_trials, n_adjusted in ((1, parameters.max_hypotheses), (None, parameters.max_adjusted)):
        hypotheses = [
            h for seed, camera in islice(trials, n_trials) for h in pose_hypotheses(task, seed, camera)
        ]
        hypotheses.sort(key=lambda h: -h.score)
        assignments += _assignments([h.camera for h in hypotheses[:n_adjusted]], task)
        if assignments and task.is_complete(_largest(assignments)):
            break
    return _unambiguous(assignments, parameters.max_rival_ratio) if assignments else None


def _assignments(cameras: Sequence[Camera], task: IdentificationTask) -> list[Assignment]:
    """Return the significant assignments of approximate cameras; after a complete one only with its lens."""
    assignments: list[Assignment] = []
    complete: Assignment | None = None
    for camera in cameras:
        try:
            if complete is None:
                assignment = refine_assignment(camera, task)
            else:
                assignment = assign_with_lens(camera, complete.camera, len(complete), task)
        except ConvergenceError:
            continue
        if assignment is not None:
            assignments.append(assignment)
            if complete is None and task.is_complete(assignment):
                complete = assignment
    return assignments


def _largest(assignments: Sequence[Assignment]) -> Assignment:
    return max(assignments, key=lambda a: (len(a), -a.sigma_px))


def _unambiguous(assignments: Sequence[Assignment], max_rival_ratio: float) -> Assignment:
    """Return the largest assignment; raise when another of the same size fits nearly as well and differs."""
    best = _largest(assignments)
    for other in assignments:
        differs = other.n_common(best) < len(other) / 2
        if differs and len(other) == len(best) and other.sigma_px < max_rival_ratio * best.sigma_px:
            raise IdentificationError(
                "the targets fit two parts of the control field equally well; show more of the board, so that its"
                " peg heights are distinctive"
            )
    return best


def _diagnosis(task: IdentificationTask, lenses: Sequence[Camera], where: str) -> CalibrationError:
    """Return the reason why no assignment was found, as far as a short search shows it."""
    field, parameters = task.field, task.parameters
    targets = f"the {len(task.pixels)} targets of {where}"
    short = replace(
        parameters, max_seeds=parameters.diagnosis_seeds, max_adjusted=parameters.diagnosis_adjusted
    )
    for signs, kind, remedy in _OTHER_AXES:
        other = ControlField(field.name, field.ids, field.points_mm * signs)
        if _fits(replace(task, field=other, parameters=short), lenses):
            return kind(f"{targets} fit control field {field.name!r} only {remedy}")
    if not short.estimate_aspect:
        free = replace(task, parameters=replace(short, estimate_aspect=True))
        exchanged = [replace(lens, pixel_size_mm=lens.pixel_size_mm[::-1]) for lens in lenses]
        if _fits(replace(task, parameters=short), exchanged) or _fits(free, lenses):
            return IdentificationError(
                f"{targets} fit control field {field.name!r} only with another pixel size; give that of this"
                " camera, width first, or estimate the aspect"
            )
    return IdentificationError(
        f"{targets} fit no part of control field {field.name!r}: give the field that was photographed, right-handed, Z"
        " up to the cameras and every height at its own peg; do not flip the image; give the pixel aspect of this"
        " camera; and show as many pegs as you can"
    )


def _fits(task: IdentificationTask, lenses: Sequence[Camera]) -> bool:
    """Return whether an assignment is found that stays significant among several searches."""
    try:
        found = _search(task, lenses)
    except IdentificationError:  # ambiguous
        return True
    return found is not None and task.is_complete(found) and len(found) > len(task.parameters.free)
