"""Radiance of a simulated world by ray tracing: parallel rays from the camera, reflected once."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Bool, Single
from spinewatch.simulation.images.world import (
    Clot,
    Cylinder,
    Ground,
    Hit,
    Lamp,
    Material,
    Smear,
    Sphere,
    World,
)

_MIN_FALL = 0.05
"""Rays that fall less than this per unit of length do not meet the ground."""
_MAX_DIELECTRIC_F0 = 0.2
"""Surfaces with less reflectance at normal incidence have a clear coat; others are metals."""
_SHARP, _BLURRED = 0.12, 0.35
"""Roughness up to which a surface mirrors its surroundings, and from which they are blurred to ground and room."""
_SURROUND_EDGE = 0.1
"""Width of the transition from surround to room, in the sine of the elevation."""
_REMAP_SIZE = 30_000
"""Texels per call of OpenCV's remap, which is limited to 32,767 in a row."""


def trace(world: World, x: Single, y: Single, ground_step: int = 1) -> tuple[Single, Bool]:
    """Return the radiance of a world at points of the image.

    The projection is parallel: over the width of a ball the rays of a camera diverge by less than a degree.

    Parameters
    ----------
    world
        The world.
    x, y
        Points of the image, shape (h, w), in radii of the sphere.
    ground_step
        Distance, in points, at which the ground is evaluated along each axis; it is interpolated between.

    Returns
    -------
    radiance : Single
        Radiance, shape (h, w), in units of the irradiance of the lamps.
    visible : Bool
        Whether the first sphere is visible at the point, shape (h, w).

    References
    ----------
    Highlights: K. Torrance, E. Sparrow, J. Opt. Soc. Am. 57 (1967) 1105; B. Walter et al., EGSR 2007 (GGX); C.
    Schlick, Computer Graphics Forum 13 (1994) 233, with his approximation of the shadowing and masking of facets.

    Examples
    --------
    >>> from spinewatch.simulation.images.random_worlds import random_setting, random_world
    >>> from spinewatch.simulation.images.textures import random_textures
    >>> rng = np.random.default_rng(0)
    >>> textures = random_textures(rng, 2, 32)
    >>> world = random_world(rng, textures, random_setting(rng, textures), present=True)
    >>> x, y = np.meshgrid(np.linspace(-2, 2, 9, dtype=np.float32), np.linspace(2, -2, 9, dtype=np.float32))
    >>> radiance, visible = trace(world, x, y)
    >>> bool(np.all(radiance >= 0)), bool(visible[0, 0])
    (True, False)
    """
    ground = world.ground
    n = ground.normal
    depth = -(x * n[0] + y * n[1]) / n[2] - ground.depth
    if ground_step > 1:
        h, w = x.shape
        coarse = (_resized(a, h // ground_step, w // ground_step) for a in (x, y, depth))
        radiance = _resized(_ground_radiance(world, *coarse), h, w)
    else:
        radiance = _ground_radiance(world, x, y, depth)
    owner = np.zeros(x.shape, np.int32)
    for number, sphere in enumerate(world.spheres, start=1):
        if (hit := sphere.hit(x, y)) is not None:
            _cover(world, (x, y), (depth, radiance, owner), hit, sphere, number)
    for cylinder in world.cylinders:
        if (hit := cylinder.hit(x, y)) is not None:
            _cover(world, (x, y), (depth, radiance, owner), hit, cylinder, -1)
    return radiance, owner == 1


def _resized(values: Single, h: int, w: int) -> Single:
    return np.asarray(cv2.resize(values, (w, h), interpolation=cv2.INTER_LINEAR), dtype=np.float32)


def _cover(
    world: World,
    xy: tuple[Single, Single],
    image: tuple[Single, Single, NDArray[np.int32]],
    hit: Hit,
    body: Sphere | Cylinder,
    number: int,
) -> None:
    """Draw a surface where it is in front of what is drawn already."""
    depth, radiance, owner = image
    front = hit.z > depth[hit.inside]
    if not front.any():
        return
    where = np.flatnonzero(hit.inside)[front]
    x, y, z = xy[0].ravel()[where], xy[1].ravel()[where], hit.z[front]
    depth.ravel()[where] = z
    owner.ravel()[where] = number
    point, normal = np.stack([x, y, z]), hit.normal[:, front]
    seen = _shade(world, point, normal, body.material)
    if isinstance(body, Sphere) and body.smear is not None:
        film = _film(body.smear, normal)
        blood = film > 0
        if blood.any():
            covered = _shade(world, point[:, blood], normal[:, blood], body.smear.material)
            seen[blood] += film[blood] * (covered - seen[blood])
    radiance.ravel()[where] = seen


def _film(smear: Smear, normal: Single) -> Single:
    """Return the cover (k,) of a sphere by blood, 0 to 1, where its normals are (3, k)."""
    u, v = (smear.origin[i] + smear.scale * normal[i] for i in (0, 1))
    return np.asarray(((_sample(smear.texture, u, v) - smear.level) / smear.thinness).clip(0, 1))


def _shade(world: World, point: Single, normal: Single, material: Material) -> Single:
    """Return the radiance (k,) of surface points (3, k): diffuse, and reflections of lamps and of ground or room."""
    cosine = normal[2].clip(0.02, 1)
    fresnel = _reflectance(material.f0, cosine)
    diffuse = material.albedo * (1 - fresnel) / (1 - material.f0)
    out = np.asarray(diffuse * _indirect(world, normal), dtype=np.float32)
    for lamp in world.lamps:
        toward = np.einsum("i,ik->k", lamp.direction, normal)
        out += diffuse / np.float32(np.pi) * lamp.irradiance * toward.clip(0)
        out += _highlight(lamp, normal, cosine, toward, material)
    reflected = 2 * normal[2] * normal
    reflected[2] -= 1
    out += fresnel * _environment(world, point, reflected, material)
    return out


def _indirect(world: World, normal: Single) -> Single:
    """Return the irradiance (k,) over pi that surfaces of given normals (3, k) receive from room and ground."""
    rise = np.einsum("i,ik->k", world.ground.normal, normal)
    room = world.ambient * (1 + 2 / 3 * np.einsum("i,ik->k", world.glow, normal))
    return np.asarray((1 + rise) / 2 * room + (1 - rise) / 2 * _mean_ground(world))


def _mean_ground(world: World) -> float:
    """Return the mean radiance of the ground outside shadows."""
    falling = (
        lamp.irradiance * max(float(world.ground.normal @ lamp.direction), 0.0) for lamp in world.lamps
    )
    return world.ground.albedo * (world.ambient + sum(falling) / np.pi)


def _environment(world: World, point: Single, direction: Single, material: Material) -> Single:
    """Return the radiance (k,) that points (3, k) reflect from directions (3, k): sharp or blurred by roughness."""
    blur = float(np.clip((material.roughness - _SHARP) / (_BLURRED - _SHARP), 0, 1))
    if blur == 0:
        out = _reflected(world, point, direction)
    else:
        rise = np.einsum("i,ik->k", world.ground.normal, direction)
        ground, room = _mean_ground(world), _room(world, direction, rise)
        out = ground + (room - ground) * (0.5 + rise / (4 * material.roughness)).clip(0, 1)
        if blur < 1:
            out = blur * out + (1 - blur) * _reflected(world, point, direction)
    if material.f0 > _MAX_DIELECTRIC_F0 and blur < 1:
        _reflect_spheres(world, point, direction, out)
    return np.asarray(out, dtype=np.float32)


def _reflect_spheres(world: World, point: Single, direction: Single, radiance: Single) -> None:
    """Replace the radiance (k,) of rays from points (3, k) in directions (3, k) where they meet spheres."""
    for sphere in world.spheres:
        to_centre = sphere.centre[:, None] - point
        along = np.einsum("ik,ik->k", to_centre, direction)
        apart2 = np.einsum("ik,ik->k", to_centre, to_centre) - along * along
        met = (along > sphere.radius / 2) & (apart2 < sphere.radius**2)
        radiance[met] = (
            (sphere.material.albedo + sphere.material.f0) * (world.ambient + _mean_ground(world)) / 2
        )


def _highlight(lamp: Lamp, normal: Single, cosine: Single, toward: Single, material: Material) -> Single:
    """Return a lamp's highlight (k,): facets of Beckmann's and the GGX distribution, widened by the lamp's size."""
    half = lamp.direction + np.array([0, 0, 1], np.float32)
    half /= np.linalg.norm(half)
    c2 = np.square(np.einsum("i,ik->k", half, normal).clip(0.05, 1))
    radius = lamp.radius_rad / 2  # of the lamp's image, in angles of the normal
    if lamp.is_disc and material.roughness < radius / 2:
        within = (radius - np.sqrt(1 / c2 - 1)) / (2 * material.roughness) + 0.5
        density = within.clip(0, 1) / np.float32(np.pi * radius**2)
    else:
        alpha2 = np.float32(material.roughness**2 + radius**2)
        ggx = alpha2 / (c2 * (alpha2 - 1) + 1) ** 2
        beckmann = np.exp((c2 - 1) / (c2 * alpha2)) / (alpha2 * c2 * c2)
        density = (material.tail * ggx + (1 - material.tail) * beckmann) / np.float32(np.pi)
    fresnel = _reflectance(material.f0, half[2:])
    hidden = np.float32(material.roughness / 2)
    lit = toward.clip(0) / (toward.clip(0) * (1 - hidden) + hidden)
    seen = 1 / (cosine * (1 - hidden) + hidden)
    return np.asarray(lamp.irradiance * fresnel * density * lit * seen / 4, dtype=np.float32)


def _reflectance(f0: float, cosine: Single) -> Single:
    """Return the reflectance: by Fresnel's equations for a clear coat, by Schlick's approximation for a metal.

    For a coat, Schlick's is a fifth too low at 50 to 60 degrees, where a ball reflects the ground.
    """
    if f0 > _MAX_DIELECTRIC_F0:
        return np.asarray(f0 + (1 - f0) * (1 - cosine) ** 5)
    n = np.float32((1 + np.sqrt(f0)) / (1 - np.sqrt(f0)))
    inside = np.sqrt(1 - (1 - cosine * cosine) / n**2)
    across = (cosine - n * inside) / (cosine + n * inside)
    along = (n * cosine - inside) / (n * cosine + inside)
    return np.asarray((across * across + along * along) / 2)


def _reflected(world: World, point: Single, direction: Single) -> Single:
    """Return the radiance (k,) of ground, walls or room, as seen from points (3, k) in directions (3, k)."""
    ground = world.ground
    n = ground.normal
    fall = -np.einsum("i,ik->k", n, direction)
    height = np.einsum("i,ik->k", n, point) + n[2] * ground.depth
    to_rim = ground.rim / np.sqrt((1 - fall * fall).clip(1e-4))
    at_wall = height - to_rim * fall  # height of the ray above the ground
    down = (height > 0) & ((at_wall <= 0) & (fall > _MIN_FALL) | (at_wall < ground.rise))
    out = _room(world, direction, -fall)
    if down.any():
        fall, wall = fall[down], at_wall[down] > 0
        distance = np.where(wall, to_rim[down], height[down] / fall.clip(_MIN_FALL))
        hit = point[:, down] + distance * direction[:, down]
        steep = np.where(wall, np.float32(ground.steep), fall.clip(_MIN_FALL, 1) ** ground.relief)
        out[down] = _ground_radiance(world, *hit) * steep / (1 + (distance / ground.extent) ** 2)
    return out


def _room(world: World, direction: Single, rise: Single) -> Single:
    """Return the radiance (k,) of the room in directions (3, k) with the sines ``rise`` (k,) of the elevation."""
    surround = world.surround
    drapes = surround.radiance * ((surround.height - rise) / _SURROUND_EDGE + 0.5).clip(0, 1)
    return np.asarray(world.ambient * (1 + np.einsum("i,ik->k", world.glow, direction)) + drapes)


def _ground_radiance(world: World, x: Single, y: Single, z: Single) -> Single:
    """Return the radiance of the ground at points of any shape."""
    ground = world.ground
    texture = _texture(ground, x, y, ground.scale)
    albedo = np.minimum(ground.albedo * np.exp(ground.contrast * texture), 0.9)
    if ground.pit < 1:
        deep = -_texture(ground, x, y, ground.scale * ground.pit_scale) - ground.pit_level
        albedo = albedo * (1 - (1 - ground.pit) * (8 * deep).clip(0, 1))
    for clot in ground.clots:
        albedo = albedo * _clot(clot, x, y)
    if (border := ground.border) is not None:
        beyond = x * border.direction[0] + y * border.direction[1] > border.distance
        albedo = np.where(beyond, np.minimum(border.factor * albedo, 0.9), albedo)
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
    """Return the texture at points of the ground, interpolated, with ``scale`` texels per radius."""
    c, s = np.cos(ground.rotation_rad) * scale, np.sin(ground.rotation_rad) * scale
    return _sample(ground.texture, c * x - s * y + ground.origin[0], s * x + c * y + ground.origin[1])


def _sample(texture: Single, u: Single, v: Single) -> Single:
    """Return a periodic texture at points (u, v) of any shape, in texels, interpolated."""
    size = np.float32(texture.shape[0])
    a, b = (np.mod(part.astype(np.float32, copy=False), size).reshape(1, -1) for part in (u, v))
    out = np.empty((1, u.size), np.float32)
    for start in range(0, u.size, _REMAP_SIZE):
        part = np.s_[:, start : start + _REMAP_SIZE]
        out[part] = cv2.remap(texture, a[part], b[part], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return out.reshape(u.shape)


def _clot(clot: Clot, x: Single, y: Single) -> Single:
    """Return the factor of the albedo at points of any shape by a spot of the ground."""
    c, s = np.cos(clot.rotation_rad) / clot.radius, np.sin(clot.rotation_rad) / clot.radius
    a, b = x - clot.centre[0], y - clot.centre[1]
    r = np.hypot((c * a + s * b) / np.sqrt(clot.stretch), (c * b - s * a) * np.sqrt(clot.stretch))
    within = ((1 - r) / clot.softness + 0.5).clip(0, 1)
    return np.asarray(1 + (clot.factor - 1) * within)


def _visibility(world: World, lamp: Lamp, x: Single, y: Single, z: Single) -> Single:
    """Return the fraction of a lamp that is not hidden from points by spheres and cylinders."""
    out = np.ones(x.shape, np.float32)
    d, least = lamp.direction, world.ground.scatter
    for sphere in world.spheres:
        a, b, c = x - sphere.centre[0], y - sphere.centre[1], z - sphere.centre[2]
        along = a * d[0] + b * d[1] + c * d[2]
        apart = np.sqrt((a * a + b * b + c * c - along * along).clip(0))
        _dim(out, apart - sphere.radius, -along, lamp, least)
    for cylinder in world.cylinders:
        across = _cross(cylinder.direction, d)
        length = float(np.linalg.norm(across))
        if length < 0.05:
            continue
        across = across / length
        a, b, c = x - cylinder.start[0], y - cylinder.start[1], z - cylinder.start[2]
        apart = np.abs(a * across[0] + b * across[1] + c * across[2])
        # Nearest points of the lamp's ray and the cylinder's axis: distances along each.
        cosine = float(cylinder.direction @ d)
        p = a * cylinder.direction[0] + b * cylinder.direction[1] + c * cylinder.direction[2]
        q = a * d[0] + b * d[1] + c * d[2]
        distance = (cosine * p - q) / length**2
        position = (p - cosine * q) / length**2
        ends = np.maximum(-position, position - cylinder.length).clip(0)
        _dim(out, np.hypot(apart, ends) - cylinder.radius, distance, lamp, least)
    return out


def _cross(a: Single, b: Single) -> Single:
    """Return the cross product of two vectors (3,); several times as fast as NumPy's general one."""
    j, k = [1, 2, 0], [2, 0, 1]
    return np.asarray(a[j] * b[k] - a[k] * b[j])


def _dim(visibility: Single, clearance: Single, distance: Single, lamp: Lamp, least: float) -> None:
    """Darken points whose ray to the lamp passes an edge at distance ``distance`` with a clearance, negative inside."""
    width = np.maximum(distance * lamp.radius_rad, least)
    passing = (0.5 + 0.5 * clearance / width).clip(0, 1)
    np.multiply(visibility, np.where(distance > 0, passing, 1), out=visibility)


def _openness(world: World, x: Single, y: Single, z: Single) -> Single:
    """Return the fraction of the room that is not hidden from points by spheres."""
    out = np.ones(x.shape, np.float32)
    for sphere in world.spheres:
        a, b, c = x - sphere.centre[0], y - sphere.centre[1], z - sphere.centre[2]
        distance2 = np.maximum(a * a + b * b + c * c, sphere.radius**2)
        out *= 1 - (sphere.radius**2 / distance2) * (-c / np.sqrt(distance2)).clip(0, 1)
    return out
