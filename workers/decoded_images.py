"""Gray levels of images that were decoded a short time ago: the stages of a surgery are compared again and again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable

from spinewatch.arrays import Pixels
from spinewatch.imaging.decoding import decode_image


class DecodedImages:
    """Keeps the gray levels of the images used last, by the SHA-256 of their files.

    Parameters
    ----------
    max_bytes
        Memory for them; a larger image is not kept.
    """

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._size = 0
        self._images: OrderedDict[str, Pixels] = OrderedDict()

    def kept(self, sha256: Iterable[str]) -> dict[str, Pixels]:
        """Return the gray levels of those of some images that are kept, which are then those used last.

        Parameters
        ----------
        sha256
            SHA-256 of each file, hexadecimal.

        Returns
        -------
        dict of str to Pixels
            Gray levels by SHA-256, shape (H, W); they must not be changed.
        """
        found = {name: self._images[name] for name in sha256 if name in self._images}
        for name in found:
            self._images.move_to_end(name)
        return found

    def decoded(self, sha256: str, content: bytes) -> Pixels:
        """Return the gray levels of an image.

        Parameters
        ----------
        sha256
            SHA-256 of the file, hexadecimal.
        content
            The file.

        Returns
        -------
        Pixels
            Gray levels, shape (H, W); they must not be changed.

        Raises
        ------
        ImageError
            The file cannot be decoded.
        """
        found = self._images.get(sha256)
        if found is None:
            found = decode_image(content)
        self.keep(sha256, found)
        return found

    def keep(self, sha256: str, pixels: Pixels) -> None:
        """Keep the gray levels of an image that was decoded elsewhere.

        Parameters
        ----------
        sha256
            SHA-256 of the file, hexadecimal.
        pixels
            Gray levels, shape (H, W); they must not be changed from now on.
        """
        known = self._images.pop(sha256, None)
        self._images[sha256] = pixels
        self._size += pixels.nbytes - (0 if known is None else known.nbytes)
        while self._size > self._max_bytes:
            _, oldest = self._images.popitem(last=False)
            self._size -= oldest.nbytes
