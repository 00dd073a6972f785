"""Simulated scenes: triads, their features, and the truth in the format of the rendered scenes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.imaging.frame import SIDES, Side
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.simulation.observations import (
    FeatureNoise,
    HiddenBall,
    Observation,
    observe,
)
from spinewatch.simulation.rigs import convergence_point, perturbed_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import Pose, ball_centres


@dataclass(frozen=True)
class SceneParameters:
    """Contents of a scene.

    Attributes
    ----------
    labels
        Vertebrae with a triad, in order along the axis.
    axis
        Object axis along the spine.
    spacing_mm
        Distance between vertebrae, mm.
    steps
        Distance from each triad to the next, as a multiple of the spacing; by default 1.
    bend_deg
        Change of direction of the chain of triads from end to end, degrees.
    noise
        Errors of the features.
    hidden
        Number of triads with one ball hidden in one view.
    calibration_sd_deg, calibration_sd_mm
        Error of the right camera in the rig that the scene is measured with: standard deviations per axis of its
        rotation, degrees, and of its position, mm.
    model
        The marker on every vertebra.
    """

    labels: tuple[str, ...] = ("L1", "T11", "T9", "T7")
    axis: Literal["x", "y"] = "x"
    spacing_mm: float = 50.0
    steps: tuple[float, ...] | None = None
    bend_deg: float = 0.0
    noise: FeatureNoise = field(default_factory=lambda: FeatureNoise(0.1, 0.0, 10))
    hidden: int = 0
    calibration_sd_deg: float = 0.0
    calibration_sd_mm: float = 0.0
    model: TriadModel = FLAT_10_14_18


@dataclass(frozen=True, eq=False)
class SimulatedScene:
    """A scene with its truth and with the data to measure it.

    Attributes
    ----------
    parameters
        The parameters of the scene.
    true_rig
        The rig that the features were simulated with.
    rig
        The rig to measure with, which includes the calibration error.
    poses
        True poses.
    hidden
        Hidden balls.
    observation
        Features of both images.
    """

    parameters: SceneParameters
    true_rig: Rig
    rig: Rig
    poses: tuple[Pose, ...]
    hidden: tuple[HiddenBall, ...]
    observation: Observation


def simulate_scene(rig: Rig, parameters: SceneParameters, rng: np.random.Generator) -> SimulatedScene:
    """Return a random scene around the point of convergence of a rig.

    Parameters
    ----------
    rig
        The true rig.
    parameters
        Contents of the scene.
    rng
        Source of random numbers.

    Returns
    -------
    SimulatedScene
        The scene; the same parameters and the same state of ``rng`` give the same scene.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> scene = simulate_scene(large_rig(), SceneParameters(labels=("L1", "T9")), np.random.default_rng(0))
    >>> len(scene.poses), len(scene.observation.left)
    (2, 16)
    """
    p = parameters
    count, balls = len(p.labels), len(p.model.balls)
    middle = convergence_point(rig)
    poses = random_spine(
        rng,
        count,
        axis=p.axis,
        spacing_mm=p.spacing_mm,
        steps=p.steps,
        bend_deg=p.bend_deg,
        centre_mm=(float(middle[0]), float(middle[1]), float(middle[2])),
    )
    triads = rng.choice(count, min(p.hidden, count), replace=False)
    hidden = tuple(
        (int(balls * t + rng.integers(balls)), SIDES[int(rng.integers(2))]) for t in np.sort(triads)
    )
    observation = observe(rig, poses, rng, p.noise, hidden=hidden, models=[p.model] * count)
    calibrated = perturbed_rig(rig, rng, p.calibration_sd_deg, p.calibration_sd_mm)
    return SimulatedScene(p, rig, calibrated, poses, hidden, observation)


def truth_document(scene: SimulatedScene, name: str) -> dict[str, Any]:
    """Return the truth of a scene in the format of the rendered scenes' truth.json.

    Parameters
    ----------
    scene
        The scene.
    name
        Its name.

    Returns
    -------
    dict
        JSON object; the keys that describe rendering are absent.
    """
    p, rig = scene.parameters, scene.true_rig
    return {
        "format": "spinewatch-simulated-1",
        "id": name,
        "kind": "single",
        "rig_id": rig.name,
        "image_size": list(rig.left.image_size_px),
        "cameras": {side: _camera_document(getattr(rig, side)) for side in SIDES},
        "rig": {"baseline_mm": rig.baseline_mm, "vergence_deg": rig.vergence_deg},
        "imaging": {
            "exposure_kind": "simulated",
            "sigma_px": p.noise.sigma_px,
            "common_sd_mrad": p.noise.common_sd_mrad,
            "false_features": p.noise.false_features,
        },
        "triads": [_triad_document(scene, index) for index in range(len(scene.poses))],
        "n_triads": len(scene.poses),
        "spine_axis": p.axis,
        "labels_along_axis": list(p.labels),
        "stage": None,
    }


def _triad_document(scene: SimulatedScene, index: int) -> dict[str, Any]:
    pose, model = scene.poses[index], scene.parameters.model
    centres = ball_centres([pose], model)[0]
    hidden = {
        (ball - index * len(centres), side) for ball, side in scene.hidden if ball // len(centres) == index
    }
    balls = {
        name: {"center_mm": centres[b].tolist()}
        | {side: _view_document(scene, centres[b], side, (b, side) not in hidden) for side in SIDES}
        for b, name in enumerate(model.balls)
    }
    return {
        "index": index,
        "vertebra": scene.parameters.labels[index],
        "P_mm": pose.position_mm.tolist(),
        "normal": pose.normal.tolist(),
        "R_object_from_triad": pose.rotation.tolist(),
        "tilt_deg": float(pose.angles_deg[2]),
        "alpha_beta_gamma_deg": pose.angles_deg.tolist(),
        "all_balls_visible_both_views": all(
            ball[side]["visible"] for ball in balls.values() for side in SIDES
        ),
        "balls": balls,
    }


def _view_document(scene: SimulatedScene, centre: Float, side: Side, visible: bool) -> dict[str, Any]:
    camera: Camera = getattr(scene.true_rig, side)
    pixel = camera.project(centre)
    inside = bool(np.all((pixel >= 0) & (pixel <= np.array(camera.image_size_px) - 1)))
    return {
        "center_px": pixel.tolist(),
        "center_plate_mm": camera.plate(pixel).tolist(),
        "diameter_px": list(
            camera.ball_diameter_px(scene.parameters.model.ball_diameter_mm, camera.depth_mm(centre))
        ),
        "distance_mm": float(np.linalg.norm(centre - camera.centre)),
        "in_image": inside,
        "visible": visible and inside,
        "visible_fraction": float(visible and inside),
    }


def _camera_document(camera: Camera) -> dict[str, Any]:
    (width, height), (px, py) = camera.image_size_px, camera.pixel_size_mm
    thesis = dict(zip(("X0_mm", "Y0_mm", "Z0_mm"), camera.position_mm, strict=True))
    thesis |= dict(zip(("omega_deg", "phi_deg", "kappa_deg"), camera.rotation_deg, strict=True))
    thesis |= {"f_mm": camera.focal_length_mm}
    thesis |= dict(zip(("x0_mm", "y0_mm"), camera.principal_point_mm, strict=True))
    thesis |= dict(zip(("K1_per_mm2", "K2"), camera.radial, strict=True))
    thesis |= dict(zip(("P1", "P2"), camera.decentering, strict=True))
    pixel = {"width": width, "height": height, "px_mm": px, "py_mm": py}
    pixel |= {"u0": (width - 1) / 2, "v0": (height - 1) / 2, "aspect": py / px}
    return {"thesis": thesis, "M": camera.M.tolist(), "pixel": pixel}
