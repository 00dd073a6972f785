"""Planes of numbers as images."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Floating, Pixels


def gray_levels(plane: Floating) -> Pixels:
    """Return a plane (H, W) with its range spread over the gray levels."""
    low, high = float(plane.min()), float(plane.max())
    return np.asarray(np.rint((plane - low) * (255 / max(high - low, 1e-9))), dtype=np.uint8)
