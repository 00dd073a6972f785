"""A report as PDF: tagged (PDF/UA-1), made offline by WeasyPrint, which is an extra."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from typing import Any

from PIL import ImageFile

from spinewatch.errors import MissingPackageError, SpinewatchError

_VARIANT = "pdf/ua-1"
_IDENTIFIER_LENGTH = 16
_DATA = "data:"
_LIBRARIES = (
    "pip install spinewatch[pdf], and the Pango library (Debian: apt install libpango-1.0-0 libpangoft2-1.0-0"
    " libharfbuzz-subset0)"
)


class ExternalReferenceError(SpinewatchError):
    """A page that is to become a PDF refers to a file or an address; reports contain everything themselves."""

    code = "external-reference"


def to_pdf(html: str) -> bytes:
    """Return an HTML page as PDF.

    Parameters
    ----------
    html
        A page that refers to no other file.

    Returns
    -------
    bytes
        A tagged PDF. The same page gives the same bytes on the same machine.

    Raises
    ------
    MissingPackageError
        If WeasyPrint or the libraries that it loads are not installed.
    ExternalReferenceError
        If the page refers to anything but ``data:``.
    """
    try:
        with _truncated_images_refused():
            import weasyprint  # noqa: PLC0415 - an optional extra
            from weasyprint.urls import FatalURLFetchingError  # noqa: PLC0415 - an optional extra
    except (ImportError, OSError) as error:
        raise MissingPackageError("The PDF report", "WeasyPrint with Pango", _LIBRARIES) from error

    class _OnlyData(weasyprint.URLFetcher):  # type: ignore[misc]
        def fetch(self, url: str, headers: Any = None) -> Any:
            if not url.startswith(_DATA):
                raise FatalURLFetchingError(url)
            return super().fetch(url, headers)

    page = weasyprint.HTML(string=html, url_fetcher=_OnlyData())
    identifier = sha256(html.encode()).digest()[:_IDENTIFIER_LENGTH]
    try:
        pdf: bytes = page.write_pdf(pdf_variant=_VARIANT, pdf_identifier=identifier)
    except FatalURLFetchingError as error:
        raise ExternalReferenceError(
            f"the page refers to {error}; a report may contain data: addresses only"
        ) from error
    return pdf


@contextmanager
def _truncated_images_refused() -> Iterator[None]:
    """Keep Pillow's setting: the import of WeasyPrint makes Pillow decode truncated images of a stage as whole."""
    before = ImageFile.LOAD_TRUNCATED_IMAGES
    try:
        yield
    finally:
        ImageFile.LOAD_TRUNCATED_IMAGES = before
