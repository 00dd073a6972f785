"""Synthetic radiographs for the page: two images of a spine, and where its landmarks are."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from tests.spinewatch.spine.radiograph_scenes import LATERAL, PA, scene, to_document

SIZES = {"pa": (2200, 4000), "lateral": (2300, 3700)}
"""Width and height of the images, px."""
SPACING = {"pa": PA.pixel_spacing_mm, "lateral": LATERAL.pixel_spacing_mm}
"""Distance of rows and of columns, mm."""
_OUTLINES = {
    "pa": ("superior_left", "superior_right", "inferior_right", "inferior_left"),
    "lateral": ("superior_anterior", "superior_posterior", "inferior_posterior", "inferior_anterior"),
}


@dataclass(frozen=True)
class Films:
    """A PA and a lateral image as PNG, and the landmarks on them as in a setup."""

    images: dict[str, bytes]
    document: dict[str, Any]


def films(levels: Sequence[str], common: int = 4, seed: int = 3) -> Films:
    """Return images of some vertebrae, and their exact landmarks."""
    document = to_document(scene(seed), "", "")
    vertebrae = {item["vertebra"]: item for item in document["vertebrae"]}
    document["vertebrae"] = [vertebrae[level] for level in levels]
    document["common"] = document["common"][:common]
    return Films({view: _picture(view, document) for view in SIZES}, document)


def _picture(view: str, document: dict[str, Any]) -> bytes:
    width, height = SIZES[view]
    shade = np.linspace(60, 20, height, dtype=np.uint8)[:, None].repeat(width, axis=1)
    image = Image.fromarray(shade)
    draw = ImageDraw.Draw(image)
    for vertebra in document["vertebrae"]:
        corners = [tuple(vertebra[view][name]) for name in _OUTLINES[view]]
        draw.polygon(corners, fill=130, outline=220, width=6)
        for name in ("pedicle_left", "pedicle_right"):
            if name in vertebra[view]:
                u, v = vertebra[view][name]
                draw.ellipse((u - 22, v - 30, u + 22, v + 30), fill=180, outline=235, width=4)
    for point in document["common"]:
        u, v = point[view]
        draw.ellipse((u - 14, v - 14, u + 14, v + 14), fill=255)
    buffer = io.BytesIO()
    image.save(buffer, "PNG")
    return buffer.getvalue()
