"""Refusal of damaged image files: decoders go on after damage, which displaces what follows it."""

from __future__ import annotations

from PIL import Image

from spinewatch.errors import ImageError
from spinewatch.imaging.jpeg_stream import is_stream_complete
from spinewatch.imaging.png_stream import require_complete_rows
from spinewatch.imaging.sun_raster import are_runs_complete
from spinewatch.imaging.tiff_segments import require_whole_segments

DAMAGED = "the image is damaged or incomplete; copy it again"
"""What is said of a file that a decoder refuses."""


def require_undamaged(data: bytes, image: Image.Image) -> None:
    """Refuse an image file whose compressed data are not exactly those of its pixels.

    Parameters
    ----------
    data
        Contents of a PNG, TIFF, JPEG or Sun raster file.
    image
        The image that `open_image` returns for it.

    Raises
    ------
    ImageError
        If the file is damaged, or is a TIFF with a compression in which damage cannot be found. A PNG is judged by
        `require_complete_rows`, a TIFF by `require_whole_segments`, a JPEG by `is_stream_complete` and a Sun raster by
        `are_runs_complete`.
    MemoryError
        If the process may not have as much memory as the pixels need.

    Examples
    --------
    >>> from io import BytesIO
    >>> buffer = BytesIO()
    >>> Image.new("L", (30, 20)).save(buffer, "PNG")
    >>> with Image.open(buffer) as image:
    ...     require_undamaged(buffer.getvalue(), image)
    """
    complete = True
    try:
        if image.format == "PNG":
            require_complete_rows(data)
        elif image.format == "TIFF":
            require_whole_segments(data, getattr(image, "tag_v2", {}))
        elif image.format == "JPEG":
            complete = is_stream_complete(data)
        else:
            complete = are_runs_complete(data)
    except (ImageError, MemoryError):
        raise
    except Exception as error:  # readers of hostile bytes raise exceptions of any class
        raise ImageError(DAMAGED) from error
    if not complete:
        raise ImageError(f"{DAMAGED} (its compressed data do not end where the image ends)")
