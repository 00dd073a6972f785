"""Radiographs of scoliotic spines for tests."""

from typing import Any

import numpy as np

from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.radiographs import FilmParameters, RadiographScene, digitized, radiograph_scene
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, random_scoliosis

FILMS = FilmParameters()
PA, LATERAL = FILMS.pa, FILMS.lateral
HEIGHT_OFFSET_MM = 0.2 * (3200 - 3500)
"""Height of the centre of the spine in the PA view minus that in the lateral view."""

OBJECT = RigidTransform(rotation_from_vector(np.array([0.2, 1.3, -0.4])), np.array([300.0, -40.0, 900.0]))


def scene(seed: int, ratio_sd: float = 0.0, object_sd_mm: float = 0.3) -> RadiographScene:
    """Return a spine, its exact landmarks and common points whose place in object space has an error."""
    rng = np.random.default_rng(seed)
    spine = random_scoliosis(rng, list(CurveKind)[seed % 3]).poses
    films = FilmParameters(pedicle_ratio_sd=ratio_sd, object_sd_mm=object_sd_mm)
    return radiograph_scene(LEVELS, spine.position_mm, spine.rotation, OBJECT, rng, films)


def seen(scene: RadiographScene, sd_px: float, seed: int) -> RadiographScene:
    """Return a scene whose landmarks have errors."""
    return digitized(scene, sd_px, np.random.default_rng(seed))


def to_document(scene: RadiographScene, pa: str, lateral: str) -> dict[str, Any]:
    """Return the landmarks of a scene as in the setup of a spine; ``pa`` and ``lateral`` identify the radiographs."""
    vertebrae = []
    for v in scene.vertebrae:
        frontal = dict(zip(_FRONTAL, v.pa_px.tolist(), strict=True))
        if v.pedicles_px is not None:
            frontal |= dict(zip(("pedicle_left", "pedicle_right"), v.pedicles_px.tolist(), strict=True))
        sagittal = dict(zip(_SAGITTAL, v.lateral_px.tolist(), strict=True))
        vertebrae.append({"vertebra": v.level, "pa": frontal, "lateral": sagittal})
    common = [
        {
            "name": c.name,
            "pa": c.pa_px.tolist(),
            "lateral": c.lateral_px.tolist(),
            "object_mm": c.object_mm.tolist(),
        }
        for c in scene.common
    ]
    return {
        "kind": "radiographs",
        "pa": pa,
        "lateral": lateral,
        "vertebrae": vertebrae,
        "common": common,
        "landmark_sd_px": 2.0,
    }


_FRONTAL = ("superior_left", "superior_right", "inferior_left", "inferior_right")
_SAGITTAL = ("superior_anterior", "superior_posterior", "inferior_anterior", "inferior_posterior")
