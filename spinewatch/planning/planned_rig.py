"""A rig that is to be built: two equal cameras side by side whose optical axes meet at the patient."""

from __future__ import annotations

import numpy as np

from spinewatch.camera import Camera, Rig
from spinewatch.rig_plausibility import check_plausible_rig
from spinewatch.simulation.rigs import CART_IMAGE_PX, CART_PIXEL_MM, angles_towards


def planned_rig(
    baseline_mm: float = 422.0,
    height_mm: float = 736.0,
    focal_length_mm: float = 7.7,
    image_size_px: tuple[int, int] = CART_IMAGE_PX,
    pixel_size_mm: tuple[float, float] = CART_PIXEL_MM,
) -> Rig:
    """Return two equal cameras without distortion, side by side along X, whose optical axes meet at the origin.

    Parameters
    ----------
    baseline_mm
        Distance between the cameras, mm.
    height_mm
        Height of both perspective centres above the point in which the axes meet, mm.
    focal_length_mm
        Focal length, mm.
    image_size_px
        (W, H), px.
    pixel_size_mm
        Width and height of a pixel, mm.

    Returns
    -------
    Rig
        The cameras, by default about those of the cart.

    Raises
    ------
    RigError
        If the rig is not plausible.

    References
    ----------
    Thesis fig. 5.3, and section 7.2 for a rig at the ceiling.

    Examples
    --------
    >>> rig = planned_rig(baseline_mm=400.0, height_mm=700.0)
    >>> rig.baseline_mm, round(rig.vergence_deg, 1)
    (400.0, 31.9)
    """

    def camera(side: int) -> Camera:
        centre = (side * baseline_mm / 2, 0.0, height_mm)
        return Camera(
            position_mm=centre,
            rotation_deg=angles_towards(np.array(centre), np.zeros(3)),
            focal_length_mm=focal_length_mm,
            principal_point_mm=(0.0, 0.0),
            radial=(0.0, 0.0),
            decentering=(0.0, 0.0),
            image_size_px=image_size_px,
            pixel_size_mm=pixel_size_mm,
        )

    rig = Rig("planned", left=camera(-1), right=camera(1))
    check_plausible_rig(rig)
    return rig
