"""Simulated images of balls whose paint, or colour of the tissue, is changed, and how well a template finds them.

As in the thesis, the template is the average of samples; half of the worlds make it, the other half are searched.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import process_time

import numpy as np

from spinewatch.arrays import Float, Single
from spinewatch.detection.candidates.correlation import similarity
from spinewatch.detection.candidates.similarity import Measure, Templates
from spinewatch.detection.candidates.template_samples import round_mask
from spinewatch.simulation.images.random_worlds import random_setting, random_world
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.sensor import SensorModel, expose
from spinewatch.simulation.images.textures import random_textures
from spinewatch.simulation.images.world import Material, World

BALL_PX = (9.1, 10.7)
"""Width and height of a ball, px."""

_HALF_PX = 28
"""Half size of an image, px."""
_TEMPLATE_PX = 9
_RAYS = 3
"""Rays per pixel and axis."""
_REACH_PX = 1.5
_MASK_RADII = 1.38
_TEXTURES, _TEXTURE_SIZE = 30, 256
_MAX_LEVEL = 160.0
_HEADROOM = 1.6

Change = Callable[[World], World]
"""A change of a world, made of one and the same random world for each variant."""


@dataclass(frozen=True)
class Found:
    """How well a template finds balls: the fraction found, errors of their centres, px, and the time per image, s.

    ``contrast`` is the median of the gray level beside a ball less that of the ball, of their sum.
    """

    recall: float
    rms_px: float
    seconds: float
    contrast: float


def worlds(count: int, seed: int = 1995) -> list[tuple[World, int]]:
    """Return random worlds with a ball at the origin, each with the seed of its sensor."""
    rng = np.random.default_rng(seed)
    textures = random_textures(rng, _TEXTURES, _TEXTURE_SIZE)
    settings = [random_setting(rng, textures) for _ in range(count)]
    return [
        (_alone(random_world(rng, textures, setting, present=True)), seed + k)
        for k, setting in enumerate(settings)
    ]


def _alone(world: World) -> World:
    """Return a world with a clean ball, and without others of its paint, which a template finds as well."""
    first, *others = world.spheres
    kept = (sphere for sphere in others if sphere.material is not first.material)
    return replace(world, spheres=(replace(first, smear=None), *kept))


def found(given: Sequence[tuple[World, int]], planes: Sequence[Change]) -> Found:
    """Return how well balls are found in images of one or more planes, the template of which is averaged of half."""
    offset = np.random.default_rng(0).uniform(-12, 12, (len(given), 2))
    images = [
        np.stack([_image(change(world), at, seed) for change in planes])
        for (world, seed), at in zip(given, offset, strict=True)
    ]
    half = len(given) // 2
    samples = [_cut(image, at) for image, at in zip(images[:half], offset[:half], strict=True)]
    mask = round_mask(BALL_PX, _MASK_RADII)
    template = np.mean(samples, axis=0)[None]
    errors, start = [], process_time()
    for image, at in zip(images[half:], offset[half:], strict=True):
        space = np.mean(
            [
                similarity(plane[None], Templates(template[:, k : k + 1], mask), Measure.RHO)[0]
                for k, plane in enumerate(image)
            ],
            axis=0,
        )
        v, u = np.unravel_index(int(space.argmax()), space.shape)
        errors.append(np.array([u, v]) - _HALF_PX - at)
    seconds = (process_time() - start) / len(errors)
    off = np.linalg.norm(errors, axis=1)
    near = off < _REACH_PX
    return Found(
        float(near.mean()),
        float(np.sqrt(np.mean(np.square(off[near])) / 2)) if near.any() else float("nan"),
        seconds,
        float(np.median([_contrast(image[0], at) for image, at in zip(images, offset, strict=True)])),
    )


def repainted(paint: Material) -> Change:
    """Return the change of the paint of all balls of a world."""

    def change(world: World) -> World:
        old = world.spheres[0].material
        spheres = tuple(
            replace(sphere, material=paint) if sphere.material is old else sphere for sphere in world.spheres
        )
        return replace(world, spheres=spheres)

    return change


def tissue_times(factor: float) -> Change:
    """Return the change of the diffuse albedo of all but balls and metal: another colour of the light or the tissue."""

    def change(world: World) -> World:
        paint = world.spheres[0].material
        spheres = tuple(
            sphere
            if sphere.material is paint
            else replace(sphere, material=replace(sphere.material, albedo=sphere.material.albedo * factor))
            for sphere in world.spheres
        )
        ground = replace(world.ground, albedo=min(world.ground.albedo * factor, _MAX_ALBEDO))
        return replace(world, spheres=spheres, ground=ground)

    return change


_MAX_ALBEDO = 0.9


def _image(world: World, at: Float, seed: int) -> Single:
    """Return gray levels (h, w) of a world whose ball lies at (u, v) from the middle, px."""
    n = (2 * _HALF_PX + 1) * _RAYS
    px = (np.arange(n) - (n - 1) / 2) / _RAYS
    x, y = np.meshgrid((px - at[0]) / (BALL_PX[0] / 2), -(px - at[1]) / (BALL_PX[1] / 2))
    radiance, _ = trace(world, x.astype(np.float32), y.astype(np.float32))
    rng = np.random.default_rng(seed)
    # The exposure of a camera follows the bright parts: expose() places the median.
    bright = max(float(np.percentile(radiance, 75)), float(np.percentile(radiance, 98)) / _HEADROOM)
    level = rng.uniform(0.4, 1.0) * _MAX_LEVEL * float(np.median(radiance)) / max(bright, 1e-9)
    sensor = SensorModel((0.6, 0.6), level, veil=0.03, black=1.0, read=1.0, shot=0.03, response=1.0)
    return expose(radiance, _RAYS, sensor, rng)


def _cut(image: Single, at: Float) -> Single:
    u, v = (round(float(x)) + _HALF_PX for x in at)
    return image[:, v - _TEMPLATE_PX : v + _TEMPLATE_PX + 1, u - _TEMPLATE_PX : u + _TEMPLATE_PX + 1]


def _contrast(image: Single, at: Float) -> float:
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    radius = np.hypot((u - _HALF_PX - at[0]) / (BALL_PX[0] / 2), (v - _HALF_PX - at[1]) / (BALL_PX[1] / 2))
    ball, beside = image[radius < 0.8].mean(), image[(radius > 1.2) & (radius < 2)].mean()
    return float((beside - ball) / (beside + ball + 1e-9))
