"""Array types that every module shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
"""Double precision: coordinates, covariances, rotations."""

Single = NDArray[np.float32]
"""Single precision: image planes, patches, network weights."""

Floating = NDArray[np.floating]
"""Either precision."""

Int = NDArray[np.intp]
"""Indices."""

Bool = NDArray[np.bool_]
"""Masks."""

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
"""An image (H, W) of raw gray levels, 8 or 16 bits."""
