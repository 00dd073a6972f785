"""Files of radiographs as plain gray images: pixels and pixel spacing, without anything that names a person."""

from __future__ import annotations

from dataclasses import dataclass, replace
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from spinewatch.arrays import Pixels
from spinewatch.errors import ImageError
from spinewatch.imaging.damage import DAMAGED, require_undamaged
from spinewatch.imaging.dicom import MAX_RADIOGRAPH_PIXELS, is_dicom, read_dicom
from spinewatch.imaging.header import open_image
from spinewatch.imaging.pixel_spacing import SpacingSource
from spinewatch.imaging.stated_view import NOTHING_STATED, StatedView

_ORIENTATION_TAG, _UPRIGHT = 274, 1
_PHOTOMETRIC_TAG, _WHITE_IS_ZERO, _BITS_TAG = 262, 0, 258
_COMPRESSION = 3


class BlankRadiographError(ImageError):
    """A radiograph of one gray level."""

    code = "radiograph-blank"


@dataclass(frozen=True, eq=False)
class RadiographImage:
    """A radiograph without metadata.

    Attributes
    ----------
    png
        The image as PNG, gray, 8 or 16 bits, encoded here from the pixels alone.
    width, height
        Size, px.
    pixel_spacing_mm
        Distance of rows and of columns that the file states, mm; None if it states none.
    spacing_source
        Which element of a DICOM file states it; None if none.
    stated_view
        View and sides that a DICOM file states.
    """

    png: bytes
    width: int
    height: int
    pixel_spacing_mm: tuple[float, float] | None
    spacing_source: SpacingSource | None
    stated_view: StatedView = NOTHING_STATED


def read_radiograph(data: bytes) -> RadiographImage:
    """Return a radiograph without the metadata of its file.

    Parameters
    ----------
    data
        Contents of a DICOM, PNG, JPEG or TIFF file with one image.

    Returns
    -------
    RadiographImage
        Gray levels and pixel spacing. A Pixel Spacing that equals the Imager Pixel Spacing is that at the detector. The
        spacing that image formats other than DICOM state is that of a printer or a screen, and is ignored.

    Raises
    ------
    DicomError
        If a DICOM file cannot be used.
    BlankRadiographError
        If all pixels are alike.
    ImageError
        If another file is no image, is damaged (`require_undamaged`), is too large, or has an orientation tag.

    References
    ----------
    DICOM PS3.3 section 10.7.1.3, for the two spacings of projection images.

    Examples
    --------
    >>> buffer = BytesIO()
    >>> Image.linear_gradient("L").resize((30, 20)).save(buffer, "PNG")
    >>> radiograph = read_radiograph(buffer.getvalue())
    >>> radiograph.width, radiograph.height, radiograph.pixel_spacing_mm
    (30, 20, None)
    """
    if not is_dicom(data):
        return _encoded(_gray_levels(data), None, None)
    found = read_dicom(data)
    spacing, source = found.imager_spacing_mm, SpacingSource.IMAGER_PIXEL_SPACING
    if found.pixel_spacing_mm not in (None, found.imager_spacing_mm):
        spacing, source = found.pixel_spacing_mm, SpacingSource.PIXEL_SPACING
    encoded = _encoded(found.pixels, spacing, None if spacing is None else source)
    return replace(encoded, stated_view=found.stated_view)


def _gray_levels(data: bytes) -> Pixels:
    """Return the gray levels (H, W) of an image file; colour of 16 bits is reduced to 8."""
    with open_image(data) as image:
        if image.width * image.height > MAX_RADIOGRAPH_PIXELS:
            raise ImageError(
                f"the image has more than {MAX_RADIOGRAPH_PIXELS // 1_000_000} million pixels; export it smaller"
            )
        require_undamaged(data, image)
        try:
            tags = getattr(image, "tag_v2", None) or image.getexif()
            orientation = tags.get(_ORIENTATION_TAG, _UPRIGHT)
            if orientation == _UPRIGHT:
                white_is_zero = image.format == "TIFF" and tags.get(_PHOTOMETRIC_TAG) == _WHITE_IS_ZERO
                image.load()
                if not image.mode.startswith("I;16"):
                    coloured = image.convert("RGBA") if image.mode in ("P", "PA") else image
                    return np.array(coloured.convert("L"))
                deep: NDArray[np.uint16] = np.asarray(image).astype(np.uint16)
                if white_is_zero:  # Pillow inverts only those of 8 bits
                    white = (1 << int(tags[_BITS_TAG][0])) - 1
                    return (white - deep.astype(np.int32)).astype(np.uint16)
                return deep
        except MemoryError:  # says nothing of the file
            raise
        except Exception as error:  # decoders of hostile bytes raise exceptions of any class
            raise ImageError(DAMAGED) from error
    raise ImageError("the image has an orientation tag; save it upright, without one")


def _encoded(
    pixels: Pixels, spacing: tuple[float, float] | None, source: SpacingSource | None
) -> RadiographImage:
    if pixels.min() == pixels.max():
        raise BlankRadiographError("the image is blank: all its pixels are alike; export it again")
    buffer = BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(buffer, "PNG", compress_level=_COMPRESSION)
    height, width = pixels.shape
    return RadiographImage(buffer.getvalue(), width, height, spacing, source)
