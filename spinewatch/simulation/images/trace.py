"""Light: what a world looks like, traced for one bounce along parallel rays."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Single
from spinewatch.simulation.images.worlds import Bar, Ground, Lamp, Material, World

_LEVEL = 0.05
"""A ray that falls less than this over its length never meets the ground."""
_DIELECTRIC = 0.2
"""Surfaces that reflect less than this at normal incidence are clear coats, others metals."""
_SOFT = 0.1
"""Over so much of the sine of the elevation what stands about the wound gives way to the room."""
_LONGEST = 30_000
"""Places that OpenCV looks up at once; more than 32,767 in a row are beyond it."""


def trace(world: World, x: Single, y: Single) -> tuple[Single, NDArray[np.bool_]]:
    """Return the radiance (h, w) at places x, y (h, w) of the picture, and where the first ball is seen.

    Parallel projection: over a ball's width a camera's rays diverge by less than a degree.
    """
    ground = world.ground
    n = ground.normal
    depth = -(x * n[0] + y * n[1]) / n[2] - ground.depth
    radiance = _ground_radiance(world, x, y, depth)
    owner = np.zeros(x.shape, np.int32)
    for number, ball in enumerate(world.balls, start=1):
        dx, dy = (x - ball.centre[0]) / ball.radius, (y - ball.centre[1]) / ball.radius
        inside = dx * dx + dy * dy < 1
        if not inside.any():
            continue
        a, b = dx[inside], dy[inside]
        normal = np.stack([a, b, np.sqrt(1 - a * a - b * b)])
        z = ball.centre[2] + ball.radius * normal[2]
        _cover(world, (x, y), (depth, radiance, owner), inside, z, normal, ball.material, number)
    for bar in world.bars:
        hit = _hit_bar(bar, x, y)
        if hit is not None:
            inside, z, normal = hit
            _cover(world, (x, y), (depth, radiance, owner), inside, z, normal, bar.material, -1)
    return radiance, owner == 1


def _cover(
    world: World,
    xy: tuple[Single, Single],
    picture: tuple[Single, Single, NDArray[np.int32]],
    inside: NDArray[np.bool_],
    z: Single,
    normal: Single,
    material: Material,
    number: int,
) -> None:
    """Draw a surface over what lies behind it: heights z and normals (3, k) at the k places ``inside``."""
    depth, radiance, owner = picture
    front = z > depth[inside]
    if not front.any():
        return
    where = np.flatnonzero(inside)[front]
    x, y = xy[0].ravel()[where], xy[1].ravel()[where]
    depth.ravel()[where] = z[front]
    owner.ravel()[where] = number
    radiance.ravel()[where] = _shade(world, np.stack([x, y, z[front]]), normal[:, front], material)


def _shade(world: World, point: Single, normal: Single, material: Material) -> Single:
    """Return the radiance (k,) of surface points (3, k): diffuse, mirrored lamps, and mirrored ground or room."""
    cosine = normal[2].clip(0.02, 1)
    fresnel = _reflectance(material.f0, cosine)
    paint = material.albedo * (1 - fresnel) / (1 - material.f0)
    out = np.asarray(paint * world.ambient, dtype=np.float32)
    for lamp in world.lamps:
        toward = np.einsum("i,ik->k", lamp.direction, normal)
        out += paint / np.float32(np.pi) * lamp.irradiance * toward.clip(0)
        out += _glint(lamp, normal, cosine, toward, material)
    mirrored = 2 * normal[2] * normal
    mirrored[2] -= 1
    out += fresnel * _mirrored(world, point, mirrored)
    return out


def _glint(lamp: Lamp, normal: Single, cosine: Single, toward: Single, material: Material) -> Single:
    """Return the reflection of a lamp by facets of Beckmann's and the GGX distribution, widened by the lamp's size."""
    half = lamp.direction + np.array([0, 0, 1], np.float32)
    half /= np.linalg.norm(half)
    alpha2 = np.float32(material.roughness**2 + (lamp.radius_rad / 2) ** 2)
    c2 = np.square(np.einsum("i,ik->k", half, normal).clip(0.05))
    ggx = alpha2 / (c2 * (alpha2 - 1) + 1) ** 2
    beckmann = np.exp((c2 - 1) / (c2 * alpha2)) / (alpha2 * c2 * c2)
    density = (material.tail * ggx + (1 - material.tail) * beckmann) / np.float32(np.pi)
    fresnel = _reflectance(material.f0, half[2:])
    return np.asarray(lamp.irradiance * fresnel * density * (toward > 0) / (4 * cosine), dtype=np.float32)


def _reflectance(f0: float, cosine: Single) -> Single:
    """Return what part of the light is mirrored: Fresnel's equations for a clear coat, Schlick's formula for metal.

    Schlick's is a fifth too low for a coat at 50 to 60 degrees, where a ball mirrors the ground.
    """
    if f0 > _DIELECTRIC:
        return np.asarray(f0 + (1 - f0) * (1 - cosine) ** 5)
    n = np.float32((1 + np.sqrt(f0)) / (1 - np.sqrt(f0)))
    inside = np.sqrt(1 - (1 - cosine * cosine) / n**2)
    across = (cosine - n * inside) / (cosine + n * inside)
    along = (n * cosine - inside) / (n * cosine + inside)
    return np.asarray((across * across + along * along) / 2)


def _mirrored(world: World, point: Single, direction: Single) -> Single:
    """Return the radiance (k,) that comes to points (3, k) from directions (3, k): the wound's or the room's."""
    ground = world.ground
    n = ground.normal
    fall = -np.einsum("i,ik->k", n, direction)
    height = np.einsum("i,ik->k", n, point) + n[2] * ground.depth
    to_rim = ground.rim / np.sqrt((1 - fall * fall).clip(1e-4))
    left = height - to_rim * fall  # above the ground where the walls stand
    down = (height > 0) & ((left <= 0) & (fall > _LEVEL) | (left < ground.rise))
    out = _room(world, -fall)
    if down.any():
        fall, wall = fall[down], left[down] > 0
        way = np.where(wall, to_rim[down], height[down] / fall.clip(_LEVEL))
        hit = point[:, down] + way * direction[:, down]
        steep = np.where(wall, np.float32(ground.steep), fall.clip(_LEVEL, 1) ** ground.relief)
        out[down] = _ground_radiance(world, *hit) * steep / (1 + (way / ground.extent) ** 2)
    return out


def _room(world: World, rise: Single) -> Single:
    """Return the radiance (k,) of the room: even, but for what stands about the wound, as high as ``rise`` (k,)."""
    about = world.surround
    return np.asarray(world.ambient + about.radiance * ((about.height - rise) / _SOFT + 0.5).clip(0, 1))


def _ground_radiance(world: World, x: Single, y: Single, z: Single) -> Single:
    ground = world.ground
    paint = _texture(ground, x, y, ground.scale)
    albedo = np.minimum(ground.albedo * np.exp(ground.contrast * paint), 0.9)
    if ground.pit < 1:
        deep = -_texture(ground, x, y, ground.scale * ground.pit_scale) - ground.pit_level
        albedo = albedo * (1 - (1 - ground.pit) * (8 * deep).clip(0, 1))
    light = np.full(x.shape, np.pi * world.ambient, np.float32) * _openness(world, x, y, z)
    for lamp in world.lamps:
        falling = float(ground.normal @ lamp.direction)
        if falling > 0:
            light += lamp.irradiance * falling * _visibility(world, lamp, x, y, z)
    if ground.gloss:
        wet = _texture(ground, x, y, ground.scale * ground.gloss_scale) - ground.gloss_level
        albedo = albedo + ground.gloss * ground.albedo * (4 * wet).clip(0, 2)
    return np.asarray(albedo * light / np.float32(np.pi))


def _texture(ground: Ground, x: Single, y: Single, scale: float) -> Single:
    c, s = np.cos(ground.turn_rad) * scale, np.sin(ground.turn_rad) * scale
    u = (c * x - s * y + ground.origin[0]).astype(np.float32)
    v = (s * x + c * y + ground.origin[1]).astype(np.float32)
    size = ground.texture.shape[0]
    u, v, out = (
        np.mod(u, size).reshape(1, -1),
        np.mod(v, size).reshape(1, -1),
        np.empty((1, x.size), np.float32),
    )
    for start in range(0, x.size, _LONGEST):
        part = np.s_[:, start : start + _LONGEST]
        out[part] = cv2.remap(ground.texture, u[part], v[part], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return out.reshape(x.shape)


def _visibility(world: World, lamp: Lamp, x: Single, y: Single, z: Single) -> Single:
    """Return how much (0..1) of a lamp points see past balls and bars."""
    out = np.ones(x.shape, np.float32)
    d = lamp.direction
    for ball in world.balls:
        a, b, c = x - ball.centre[0], y - ball.centre[1], z - ball.centre[2]
        along = a * d[0] + b * d[1] + c * d[2]
        apart = np.sqrt((a * a + b * b + c * c - along * along).clip(0))
        _dim(out, apart - ball.radius, -along, lamp)
    for bar in world.bars:
        across = _cross(bar.direction, d)
        length = float(np.linalg.norm(across))
        if length < 0.05:
            continue
        across = across / length
        a, b, c = x - bar.start[0], y - bar.start[1], z - bar.start[2]
        apart = np.abs(a * across[0] + b * across[1] + c * across[2])
        # Where along the lamp's ray, and along the bar, the two lines pass each other.
        turn = float(bar.direction @ d)
        p = a * bar.direction[0] + b * bar.direction[1] + c * bar.direction[2]
        q = a * d[0] + b * d[1] + c * d[2]
        way = (turn * p - q) / length**2
        place = (p - turn * q) / length**2
        ends = np.maximum(-place, place - bar.length).clip(0)
        _dim(out, np.hypot(apart, ends) - bar.radius, way, lamp)
    return out


def _cross(a: Single, b: Single) -> Single:
    """Return the vector product of two vectors, for which NumPy's general one takes several times as long."""
    turn, back = [1, 2, 0], [2, 0, 1]
    return np.asarray(a[turn] * b[back] - a[back] * b[turn])


def _dim(visibility: Single, clearance: Single, way: Single, lamp: Lamp) -> None:
    """Darken points whose ray to the lamp passes an edge ``way`` ahead with a clearance (negative inside)."""
    width = np.maximum(way * lamp.radius_rad, 0.02)
    passing = (0.5 + 0.5 * clearance / width).clip(0, 1)
    np.multiply(visibility, np.where(way > 0, passing, 1), out=visibility)


def _openness(world: World, x: Single, y: Single, z: Single) -> Single:
    """Return how much (0..1) of the room points see past balls."""
    out = np.ones(x.shape, np.float32)
    for ball in world.balls:
        a, b, c = x - ball.centre[0], y - ball.centre[1], z - ball.centre[2]
        distance2 = np.maximum(a * a + b * b + c * c, ball.radius**2)
        out *= 1 - (ball.radius**2 / distance2) * (-c / np.sqrt(distance2)).clip(0, 1)
    return out


def _hit_bar(bar: Bar, x: Single, y: Single) -> tuple[NDArray[np.bool_], Single, Single] | None:
    """Return where parallel rays meet a bar's side: the mask (h, w), heights (k,) and normals (3, k)."""
    d = bar.direction
    level = np.hypot(d[0], d[1])
    if level < 0.2:
        return None
    a, b = x - bar.start[0], y - bar.start[1]
    off = (a * -d[1] + b * d[0]) / level
    inside = np.abs(off) < bar.radius
    along = (a * d[0] + b * d[1]) / level  # on the picture, of the ray
    lift = np.sqrt((bar.radius**2 - off**2).clip(0))
    # The surface is lifted across the bar, in the plane of the ray: back along the picture, up to the camera.
    place = (along + lift * d[2]) / level
    inside &= (place > 0) & (place < bar.length)
    if not inside.any():
        return None
    off, lift, place = off[inside], lift[inside], place[inside]
    z = bar.start[2] + place * d[2] + lift * level
    side = off / bar.radius
    up = lift / bar.radius
    normal = np.stack(
        [
            side * -d[1] / level - up * d[2] * d[0] / level,
            side * d[0] / level - up * d[2] * d[1] / level,
            up * level,
        ]
    )
    return inside, z.astype(np.float32), normal.astype(np.float32)
