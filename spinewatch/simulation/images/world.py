"""The world that an image shows: a ball on its leg above wet tissue, objects around it, and the lamps.

Lengths are in radii of the ball. The origin is its centre; z points to the camera, x to the right and y up in the
image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Single

_MIN_LEVEL = 0.2
"""Cylinders whose axis is nearer to the viewing direction, by the sine of the angle, are not drawn."""


@dataclass(frozen=True, eq=False)
class Hit:
    """Where rays along the viewing direction meet a surface.

    Attributes
    ----------
    inside
        Whether the ray through a point of the image meets it, shape (h, w), true for k points.
    z
        Heights of the points of intersection, shape (k,).
    normal
        Unit normals there, shape (3, k).
    """

    inside: Bool
    z: Single
    normal: Single


@dataclass(frozen=True, eq=False)
class Lamp:
    """A round, distant lamp.

    Attributes
    ----------
    direction
        Unit vector towards the lamp, shape (3,).
    radius_rad
        Angular radius, radians.
    irradiance
        Irradiance of a surface that faces the lamp.
    is_disc
        Whether its reflection has a sharp edge; else it is brightest in the middle.
    """

    direction: Single
    radius_rad: float
    irradiance: float
    is_disc: bool = False


@dataclass(frozen=True, eq=False)
class Material:
    """The reflection of a surface.

    Attributes
    ----------
    albedo
        Diffuse albedo under the clear coat.
    roughness
        Roughness of the coat: root mean square slope of its facets.
    f0
        Reflectance at normal incidence.
    tail
        Share of the GGX distribution of slopes, 0 to 1; the rest is Beckmann's. Highlights of the former have long
        tails.
    """

    albedo: float
    roughness: float
    f0: float
    tail: float


@dataclass(frozen=True, eq=False)
class Smear:
    """Blood on a sphere: a film where a texture, projected along z, exceeds a level.

    Attributes
    ----------
    material
        The blood.
    texture
        Texture of zero mean and unit variance, shape (n, n).
    scale
        Texels per radius of the sphere.
    origin
        Texel at the sphere's centre, shape (2,).
    level
        Value of the texture at the edge of the film.
    thinness
        Difference of the texture over which the film changes from none to opaque.
    """

    material: Material
    texture: Single
    scale: float
    origin: Single
    level: float
    thinness: float


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball, or a rounded object beside it.

    Attributes
    ----------
    centre
        Centre, shape (3,).
    radius
        Radius.
    material
        Its surface.
    smear
        Blood on it, or None.
    """

    centre: Single
    radius: float
    material: Material
    smear: Smear | None = None

    def hit(self, x: Single, y: Single) -> Hit | None:
        """Return where rays along the viewing direction meet the sphere.

        Parameters
        ----------
        x, y
            Points of the image, shape (h, w).

        Returns
        -------
        Hit or None
            The upper points of intersection; None if no ray meets the sphere.
        """
        dx, dy = (x - self.centre[0]) / self.radius, (y - self.centre[1]) / self.radius
        inside = dx * dx + dy * dy < 1
        if not inside.any():
            return None
        a, b = dx[inside], dy[inside]
        normal = np.stack([a, b, np.sqrt(1 - a * a - b * b)])
        return Hit(inside, self.centre[2] + self.radius * normal[2], normal)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A leg, rod or instrument with flat ends.

    Attributes
    ----------
    start
        Start of the axis, shape (3,).
    direction
        Unit vector along the axis, shape (3,).
    length
        Length of the axis.
    radius
        Radius.
    material
        Its surface.
    """

    start: Single
    direction: Single
    length: float
    radius: float
    material: Material

    def hit(self, x: Single, y: Single) -> Hit | None:
        """Return where rays along the viewing direction meet the side of the cylinder.

        Parameters
        ----------
        x, y
            Points of the image, shape (h, w).

        Returns
        -------
        Hit or None
            The upper points of intersection; None if no ray meets the side, or if the axis is almost parallel to the
            viewing direction.
        """
        d = self.direction
        level = np.hypot(d[0], d[1])
        if level < _MIN_LEVEL:
            return None
        a, b = x - self.start[0], y - self.start[1]
        off = (a * -d[1] + b * d[0]) / level
        inside = np.abs(off) < self.radius
        along = (a * d[0] + b * d[1]) / level
        lift = np.sqrt((self.radius**2 - off**2).clip(0))
        # The surface is displaced from the axis in the plane of ray and axis, at a right angle to the axis.
        position = (along + lift * d[2]) / level
        inside &= (position > 0) & (position < self.length)
        if not inside.any():
            return None
        off, lift, position = off[inside], lift[inside], position[inside]
        z = self.start[2] + position * d[2] + lift * level
        side = off / self.radius
        up = lift / self.radius
        normal = np.stack(
            [
                side * -d[1] / level - up * d[2] * d[0] / level,
                side * d[0] / level - up * d[2] * d[1] / level,
                up * level,
            ]
        )
        return Hit(inside, z.astype(np.float32), normal.astype(np.float32))


@dataclass(frozen=True, eq=False)
class Clot:
    """An elliptical spot of the ground that is darker or brighter: a clot, char, a hole, a piece of fat.

    Attributes
    ----------
    centre
        Position (x, y), shape (2,).
    radius
        Mean radius.
    stretch
        Ratio of its axes.
    rotation_rad
        Direction of the longer axis, radians.
    softness
        Width of its edge, in radii of the spot.
    factor
        Factor of the albedo in it.
    """

    centre: Single
    radius: float
    stretch: float
    rotation_rad: float
    softness: float
    factor: float


@dataclass(frozen=True, eq=False)
class Border:
    """A straight border beyond which the ground is another material: a sponge, a drape, bone.

    Attributes
    ----------
    direction
        Unit vector across the border, shape (2,).
    distance
        Distance from the origin.
    factor
        Factor of the albedo beyond it.
    """

    direction: Single
    distance: float
    factor: float


@dataclass(frozen=True, eq=False)
class Ground:
    """Tissue: a textured plane through ``(0, 0, -depth)``, with walls around it.

    Attributes
    ----------
    depth
        Depth of the plane under the ball's centre.
    normal
        Unit normal, shape (3,).
    texture
        Periodic texture of zero mean and unit variance, shape (n, n).
    scale
        Texels per radius.
    origin
        Texel under the ball's centre, shape (2,).
    rotation_rad
        Rotation of the texture, radians.
    albedo
        Median albedo.
    contrast
        The albedo is ``albedo exp(contrast texture)``.
    gloss
        Additional albedo of wet spots, as a multiple of ``albedo``.
    gloss_scale
        Scale of wet spots relative to ``scale``.
    gloss_level
        Texture value above which a spot is wet.
    pit
        Fraction of the albedo that remains in a pit or clot.
    pit_scale
        Scale of pits relative to ``scale``.
    pit_level
        Pits are where the texture is below ``-pit_level``.
    relief
        Rough tissue is darker at grazing angles, by the cosine to this power.
    extent
        Distance at which the irradiance has dropped to one half.
    rim
        Distance of the walls.
    rise
        Height of the walls.
    steep
        Radiance of the walls relative to the ground.
    scatter
        Least width of the edges of shadows: light spreads under the surface of tissue.
    clots
        Spots of another albedo.
    border
        Border with another material, or None.
    """

    depth: float
    normal: Single
    texture: Single
    scale: float
    origin: Single
    rotation_rad: float
    albedo: float
    contrast: float
    gloss: float
    gloss_scale: float
    gloss_level: float
    pit: float
    pit_scale: float
    pit_level: float
    relief: float
    extent: float
    rim: float
    rise: float
    steep: float
    scatter: float = 0.02
    clots: tuple[Clot, ...] = ()
    border: Border | None = None


@dataclass(frozen=True)
class Surround:
    """Lit drapes, retractors and people around the wound.

    Attributes
    ----------
    radiance
        Their radiance above the ambient one.
    height
        Sine of the elevation up to which they extend.
    """

    radiance: float
    height: float


@dataclass(frozen=True, eq=False)
class World:
    """Everything that an image shows.

    Attributes
    ----------
    spheres
        Balls and rounded objects; the first is the ball at the origin, if ``present``.
    cylinders
        Legs, rods and instruments.
    ground
        The tissue.
    lamps
        The lamps.
    lamp
        Unit vector to the cart's lamp or to the middle of its lamps, shape (3,).
    ambient
        Mean radiance of the room.
    glow
        Gradient of that radiance: it is ``1 + glow . d`` times the mean in direction d, shape (3,).
    surround
        Objects around the wound.
    present
        Whether there is a ball at the origin.
    up
        Unit vector that points up in the room, shape (3,).
    """

    spheres: tuple[Sphere, ...]
    cylinders: tuple[Cylinder, ...]
    ground: Ground
    lamps: tuple[Lamp, ...]
    lamp: Single
    ambient: float
    glow: Single
    surround: Surround
    present: bool
    up: Single
