"""Which target is which control point: by hypothesis and test, for a board moved and turned anyhow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, product

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from spinewatch.arrays import Float
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import (
    BoardOrientationError,
    CalibrationError,
    ConvergenceError,
    IdentificationError,
    MirroredFieldError,
    TargetsNotFoundError,
)
from spinewatch.calibration.marks.detection import Targets
from spinewatch.calibration.points import ImagePoints, Sensor
from spinewatch.calibration.solve.bundle import Block, adjust
from spinewatch.calibration.solve.collinearity import EXTERIOR
from spinewatch.calibration.solve.initial_values import exterior, with_exterior
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform

Index = NDArray[np.intp]

_LENS = (*EXTERIOR, "f", "x0", "y0", "K1")
_TRIPLES = 1000  # the most alike; keeps time and memory for a large field from growing with its square
_POSES_AT_ONCE = 256
_LOOSE = 1e-5
_EVALUATIONS = 20  # a right hypothesis needs fewer; wrong ones would go on for hundreds
_IDENTITY = np.eye(3)
_REFUSED_SEEDS, _REFUSED_TRIES = 2, 12
_OTHER_AXES: tuple[tuple[tuple[int, int, int], type[CalibrationError], str], ...] = (
    (
        (-1, 1, 1),
        MirroredFieldError,
        "mirrored: give right-handed coordinates, for which X and Y may be exchanged or pegs numbered from the wrong"
        " side, and do not flip the picture",
    ),
    (
        (1, 1, -1),
        MirroredFieldError,
        "with the sign of every Z reversed; Z must point up to the cameras, and higher pegs have a larger z_mm",
    ),
    (
        (1, -1, -1),
        BoardOrientationError,
        "upside down; turn its axes so that Z points up to the cameras, and higher pegs have a larger z_mm",
    ),
)
"""Signs of a field's axes that are mistaken for one another, and what to say when one of them fits."""


@dataclass(frozen=True)
class MarkIdentificationParameters:
    """How targets are named.

    ``least`` targets that must be named, and ``complete`` the fraction of those found; ``focal_widths`` focal
    lengths to try, in plate widths; ``neighbours`` control points that may be next to one another in the image
    although others lie nearer; ``coarse`` tolerance of a match, in spacings of the targets; ``fine`` tolerance,
    ``fit`` and ``tight_fit`` standard deviations, in image widths: a naming must fit, and one that rests on few
    targets or leaves many out must fit tightly; ``refined`` hypotheses are kept for each of ``seeds`` and focal
    lengths; those of the first are adjusted, then at most ``tries`` of all others, the best first;
    ``estimate_aspect`` adjusts the pixels' aspect with the lens.
    """

    least: int = 8
    complete: float = 0.8
    focal_widths: tuple[float, ...] = (1.35, 0.8, 2.4)
    neighbours: int = 8
    coarse: float = 0.35
    fine: float = 0.003
    fit: float = 0.0015
    tight_fit: float = 0.0005
    refined: int = 12
    seeds: int = 6
    tries: int = 128
    estimate_aspect: bool = False

    @property
    def lens(self) -> tuple[str, ...]:
        """Parameters of the camera that are adjusted to many targets."""
        return (*_LENS, "aspect") if self.estimate_aspect else _LENS


@dataclass(frozen=True, eq=False)
class Identified:
    """Named image points, and the ``camera`` that explains them: good enough to start from in the next shot."""

    points: ImagePoints
    camera: Camera


@dataclass(frozen=True, eq=False)
class _Naming:
    target: Index
    control: Index
    sigma_px: float
    camera: Camera


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    camera: Camera
    score: float


@dataclass(frozen=True, eq=False)
class _Task:
    """Targets to be named, the field, and the tolerances that follow from both."""

    pixels: Float
    field: ControlField
    spacing_px: float
    width_px: int
    parameters: MarkIdentificationParameters

    @property
    def limit_px(self) -> float:
        return self.parameters.fine * self.width_px

    def is_complete(self, naming: _Naming) -> bool:
        return len(naming.target) >= self.parameters.complete * len(self.pixels)

    def is_tight(self, naming: _Naming) -> bool:
        return naming.sigma_px < self.parameters.tight_fit * self.width_px

    def is_sound(self, naming: _Naming) -> bool:
        """Return whether chance could not have made a naming that fits so well."""
        if self.is_tight(naming):
            return self.is_complete(naming) or len(naming.target) > len(self.parameters.lens)
        many = len(naming.target) > len(self.parameters.lens) and self.is_complete(naming)
        return many and naming.sigma_px < self.parameters.fit * self.width_px


def identify(
    targets: Targets,
    field: ControlField,
    sensor: Sensor,
    parameters: MarkIdentificationParameters | None = None,
    where: str = "the image",
    known: Camera | None = None,
) -> Identified:
    """Return the targets that are control points, named, in the field's order.

    Three neighbouring targets are taken for every three neighbouring control points that look alike; the pose
    that this means predicts where all others appear; the hypotheses that explain most targets are adjusted,
    lens included, and the best is taken. Targets that fit no control point are left out. ``known`` is a
    camera whose lens is this one's.

    Raises ``TargetsNotFoundError`` for fewer than ``least`` targets, and ``IdentificationError`` when no
    hypothesis explains them or two explain them equally well.
    """
    parameters = parameters or MarkIdentificationParameters()
    if len(targets) < parameters.least:
        raise TargetsNotFoundError(
            f"{where} shows {len(targets)} targets; at least {parameters.least} are needed: light the board evenly,"
            " focus, and keep pegs from hiding each other"
        )
    task = _Task(targets.pixels, field, _spacing(targets.pixels), sensor.image_size_px[0], parameters)
    plate = float(sensor.plate_mm[0])
    lenses = [sensor.camera(focal_length_mm=width * plate) for width in parameters.focal_widths]
    try:
        found = _search(task, lenses if known is None else [known, *lenses])
    except IdentificationError as error:
        raise IdentificationError(f"{where}: {error}") from error
    if found is None:
        raise _refusal(task, lenses, where)
    order = np.argsort(found.control)
    target, control = found.target[order], found.control[order]
    ids = [field.ids[i] for i in control]
    points = ImagePoints.build(ids, field.points_mm[control], targets.pixels[target], targets.sd_px[target])
    return Identified(points, found.camera)


def _search(task: _Task, lenses: list[Camera]) -> _Naming | None:
    """Return the naming that explains most targets, or None; raise when another does equally well."""
    starts = product(islice(_seeds(task.pixels), task.parameters.seeds), lenses)
    namings: list[_Naming] = []
    for count, tries in ((1, task.parameters.refined), (None, task.parameters.tries)):
        found = [h for seed, camera in islice(starts, count) for h in _hypotheses(task, seed, camera)]
        found.sort(key=lambda h: -h.score)
        namings += _explain([h.camera for h in found[:tries]], task)
        if namings and task.is_complete(_most(namings)):
            break
    return _unambiguous(namings) if namings else None


def _refusal(task: _Task, lenses: list[Camera], where: str) -> CalibrationError:
    """Return why no naming was found: what would have to be otherwise for one, as far as a short search can tell."""
    field = task.field
    count = len(task.pixels)
    start = f"the {count} targets of {where} fit control field {field.name!r}"
    short = replace(task.parameters, seeds=_REFUSED_SEEDS, tries=_REFUSED_TRIES)
    for signs, kind, remedy in _OTHER_AXES:
        turned = ControlField(field.name, field.ids, field.points_mm * signs)
        if _fits(replace(task, field=turned, parameters=short), lenses):
            return kind(f"{start} only {remedy}")
    if not short.estimate_aspect:
        free = replace(task, parameters=replace(short, estimate_aspect=True))
        if _fits(free, lenses):
            return IdentificationError(
                f"{start} only with another pixel aspect; give the pixel size of this camera, or estimate the aspect"
            )
    return IdentificationError(
        f"the {count} targets of {where} fit no part of control field {field.name!r}: give the field that was"
        " photographed, right-handed, Z up to the cameras and every height at its own peg; do not flip the picture;"
        " give the pixel aspect of this camera; and show as many pegs as you can"
    )


def _fits(task: _Task, lenses: list[Camera]) -> bool:
    """Return whether a naming is found of so many targets that it is a finding, and not one of several tries."""
    try:
        naming = _search(task, lenses)
    except IdentificationError:  # in two places
        return True
    return naming is not None and task.is_complete(naming) and len(naming.target) > len(task.parameters.lens)


def _explain(hypotheses: list[Camera], task: _Task) -> list[_Naming]:
    """Return the sound namings that hypotheses grow to; once one is complete, others are tried with its lens alone."""
    namings: list[_Naming] = []
    complete: _Naming | None = None
    for camera in hypotheses:
        try:
            naming = _refine(camera, task) if complete is None else _rival(camera, complete, task)
        except ConvergenceError:
            continue
        if naming is not None:
            namings.append(naming)
            if complete is None and task.is_complete(naming):
                complete = naming
    return namings


def _rival(camera: Camera, complete: _Naming, task: _Task) -> _Naming | None:
    target, control = _match(
        camera, task.pixels, task.field.points_mm, task.parameters.coarse * task.spacing_px
    )
    if len(target) < len(complete.target):
        return None
    lens = complete.camera
    placed = with_exterior(lens, exterior(_image(target, control, task), lens))
    return _within(placed, task, len(EXTERIOR))


def _most(namings: list[_Naming]) -> _Naming:
    return max(namings, key=lambda n: (len(n.target), -n.sigma_px))


def _unambiguous(namings: list[_Naming]) -> _Naming:
    best = _most(namings)
    for other in namings:
        same = set(zip(other.target, other.control, strict=True)) & set(
            zip(best.target, best.control, strict=True)
        )
        if (
            len(same) < len(other.target) / 2
            and len(other.target) == len(best.target)
            and other.sigma_px < 3 * best.sigma_px
        ):
            raise IdentificationError(
                "the targets fit two parts of the control field equally well; show more of the board, so that its"
                " peg heights tell where it is"
            )
    return best


def _spacing(pixels: Float) -> float:
    d = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)
    np.fill_diagonal(d, np.inf)
    return float(np.median(d.min(axis=1)))


def _seeds(pixels: Float) -> Iterator[Index]:
    """Yield triples of neighbouring targets, the most central first."""
    centre = np.median(pixels, axis=0)
    for first in np.argsort(np.linalg.norm(pixels - centre, axis=1)):
        away = pixels - pixels[first]
        near = np.argsort(np.linalg.norm(away, axis=1))[1:6]
        for second, third in ((near[0], k) for k in near[1:]):
            a, b = away[second], away[third]
            sine = (a[0] * b[1] - a[1] * b[0]) / (np.linalg.norm(a) * np.linalg.norm(b))
            if abs(sine) > 0.5:
                yield np.array([first, second, third])
                break


def _hypotheses(task: _Task, seed: Index, camera: Camera) -> list[_Hypothesis]:
    """Return poses, best first, that explain most targets when the seed is three neighbouring control points."""
    X, pixels = task.field.points_mm, task.pixels
    triples = _alike(pixels[seed], X, camera, task.parameters.neighbours)
    ideal = camera.undistort(camera.plate(pixels[seed])) / camera.focal_length_mm * (1, -1)
    turns: list[Float] = []
    shifts: list[Float] = []
    for triple in triples:
        _, turned, shifted = cv2.solveP3P(X[triple], ideal, _IDENTITY, None, flags=cv2.SOLVEPNP_AP3P)
        turns += (np.asarray(v, dtype=np.float64) for v in turned)
        shifts += (np.asarray(v, dtype=np.float64) for v in shifted)
    if not turns:
        return []
    R = Rotation.from_rotvec(np.array(turns).reshape(-1, 3)).as_matrix()
    t = np.array(shifts).reshape(-1, 3)
    up = R[:, 2, 2] < 0  # the board's Z towards the camera, which looks along OpenCV's Z
    R, t = R[up], t[up]
    tolerance = task.parameters.coarse * task.spacing_px
    score = np.empty(len(R))
    for first in range(0, len(R), _POSES_AT_ONCE):
        part = slice(first, first + _POSES_AT_ONCE)
        score[part] = _score(R[part], t[part], X, camera, pixels, tolerance)
    flip = np.diag([1.0, -1.0, -1.0])
    best = np.argsort(-score, kind="stable")[: task.parameters.refined]
    return [
        _Hypothesis(with_exterior(camera, RigidTransform(flip @ R[k], flip @ t[k])), float(score[k]))
        for k in best
    ]


def _alike(seed_px: Float, X: Float, camera: Camera, neighbours: int) -> Index:
    """Return the triples (m, 3) of neighbouring control points whose triangle resembles the seed's, seen from above."""
    image = camera.plate(seed_px)
    a, b = image[1] - image[0], image[2] - image[0]
    d = np.linalg.norm(X[:, None, :2] - X[None, :, :2], axis=2)
    near = np.argsort(d, axis=1, kind="stable")[:, 1 : neighbours + 1]
    p = np.repeat(np.arange(len(X)), near.shape[1] ** 2)
    q = np.repeat(near, near.shape[1], axis=1).ravel()
    r = np.tile(near, (1, near.shape[1])).ravel()
    A, B = X[q, :2] - X[p, :2], X[r, :2] - X[p, :2]
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (A, B, A - B))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.stack([np.linalg.norm(a) / la, np.linalg.norm(b) / lb, np.linalg.norm(a - b) / lc])
        unlike = ratios.max(axis=0) / ratios.min(axis=0)
        similar = (q != r) & (unlike < 2.2)
    side = np.sign(a[0] * b[1] - a[1] * b[0])
    similar &= side * (A[:, 0] * B[:, 1] - A[:, 1] * B[:, 0]) > 0
    kept = np.flatnonzero(similar)
    kept = kept[np.argsort(unlike[kept], kind="stable")[:_TRIPLES]]
    return np.asarray(np.stack([p, q, r], axis=1)[kept])


def _score(R: Float, t: Float, X: Float, camera: Camera, pixels: Float, tolerance: float) -> Float:
    """Return for each pose (m) how many targets have a control point near, nearer ones counting more."""
    Xc = np.einsum("mij,nj->mni", R, X) + t[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        ideal = camera.focal_length_mm * Xc[..., :2] / Xc[..., 2:] * (1, -1)
    ideal[Xc[..., 2] <= 0] = np.inf
    predicted = camera.pixels(ideal)
    d2 = ((predicted[:, None] - pixels[None, :, None]) ** 2).sum(axis=3).min(axis=2)
    return np.asarray(np.maximum(1 - d2 / tolerance**2, 0).sum(axis=1))


def _refine(camera: Camera, task: _Task) -> _Naming | None:
    """Return the naming that a pose grows to: match, adjust with ever more of the lens, match closer again."""
    X, limit, lens = task.field.points_mm, task.limit_px, task.parameters.lens
    coarse = task.parameters.coarse * task.spacing_px
    target, control = _match(camera, task.pixels, X, coarse)
    if len(target) < task.parameters.least:
        return None
    camera = with_exterior(camera, exterior(_image(target, control, task), camera))
    at_once = _within(camera, task, len(EXTERIOR))
    if at_once is not None and task.is_complete(at_once) and task.is_tight(at_once):
        return at_once
    for tolerance, free in ((0.6 * coarse, (*EXTERIOR, "f", "K1")), (0.3 * coarse, lens), (limit, lens)):
        target, control = _match(camera, task.pixels, X, max(tolerance, limit))
        if len(target) < task.parameters.least:
            return None
        usable = free if 2 * len(target) > len(free) + 2 else (*EXTERIOR, "f")
        block = _block(camera, _image(target, control, task), usable)
        adjusted = adjust(
            block, robust_px=max(tolerance / 4, 0.5), tolerance=_LOOSE, evaluations=_EVALUATIONS
        )
        camera = adjusted.block.cameras[0]
        if camera.pixel_size_mm[1] <= 0:  # a mirrored picture
            return None
    return _within(camera, task, len(lens))


def _within(camera: Camera, task: _Task, unknowns: int) -> _Naming | None:
    """Return the naming of the targets that a camera explains to the fine tolerance, if it is sound."""
    target, control = _match(camera, task.pixels, task.field.points_mm, task.limit_px)
    freedom = 2 * len(target) - unknowns
    if len(target) < task.parameters.least or freedom <= 0:
        return None
    miss = camera.project(task.field.points_mm[control]) - task.pixels[target]
    naming = _Naming(target, control, float(np.sqrt((miss**2).sum() / freedom)), camera)
    return naming if task.is_sound(naming) else None


def _image(target: Index, control: Index, task: _Task) -> ImagePoints:
    ids = [task.field.ids[i] for i in control]
    return ImagePoints.build(ids, task.field.points_mm[control], task.pixels[target])


def _block(camera: Camera, image: ImagePoints, free: tuple[str, ...]) -> Block:
    return Block((camera,), (RigidTransform.identity(),), {(0, 0): image}, (free,))


def _match(camera: Camera, pixels: Float, X: Float, tolerance: float) -> tuple[Index, Index]:
    """Return targets and control points that belong together one to one, no further apart than the tolerance."""
    with np.errstate(all="ignore"):
        predicted = camera.project(X)
    d = np.linalg.norm(pixels[:, None] - predicted[None], axis=2)
    d = np.where(np.isfinite(d), np.minimum(d, 2 * tolerance), 2 * tolerance)
    i, j = linear_sum_assignment(d)
    near = d[i, j] < tolerance
    return i[near], j[near]
