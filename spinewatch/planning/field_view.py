"""Which points of a control field both images of a rig show."""

from __future__ import annotations

import numpy as np

from spinewatch.calibration.control_field import ControlField
from spinewatch.camera import Rig


def visible_in_both(rig: Rig, field: ControlField, margin_px: float = 0.0) -> tuple[str, ...]:
    """Return the control points that lie inside both images.

    Parameters
    ----------
    rig
        The cameras.
    field
        The control field.
    margin_px
        Minimum distance from the borders of the images, px.

    Returns
    -------
    tuple of str
        Ids, in the order of the field.
    """
    visible = np.ones(len(field), dtype=bool)
    for camera in (rig.left, rig.right):
        with np.errstate(all="ignore"):
            pixels = camera.project(field.points_mm)
            last = np.array(camera.image_size_px) - 1 - margin_px
            visible &= np.all((pixels >= margin_px) & (pixels <= last), axis=1)
    return tuple(id_ for id_, ok in zip(field.ids, visible, strict=True) if ok)
