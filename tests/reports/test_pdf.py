import contextlib
import re
import shutil
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from reports.pdf import ExternalReferenceError, to_pdf
from reports.surgery import render_surgery
from tests.contract.spine_results import summary
from tests.paths import PROJECT

PIXEL = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7"


@pytest.fixture(scope="module")
def pdf() -> bytes:
    return to_pdf(render_surgery(summary()))


def contents(pdf: bytes) -> bytes:
    """The file with its compressed streams after it."""
    unpacked = [pdf]
    for stream in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, re.DOTALL):
        with contextlib.suppress(zlib.error):
            unpacked.append(zlib.decompress(stream))
    return b"\n".join(unpacked)


def test_the_report_is_a_tagged_pdf_with_language_title_and_alternative_texts(pdf: bytes) -> None:
    found = contents(pdf)
    assert pdf.startswith(b"%PDF-1.7")
    assert b"pdfuaid" in found
    assert b"/StructTreeRoot" in found
    assert re.search(rb"/Lang ?\(en\)", found)
    assert b"Spine report of case 2026-0417" in found
    assert found.count(b"/Alt") == render_surgery(summary()).count("<svg")


def test_no_clock_enters_the_file(pdf: bytes) -> None:
    assert to_pdf(render_surgery(summary())) == pdf
    assert not re.search(rb"/CreationDate|/ModDate", contents(pdf))


def test_the_text_can_be_read_back(pdf: bytes, tmp_path: Path) -> None:
    if shutil.which("pdftotext") is None:
        pytest.skip("pdftotext is not installed (Debian: apt install poppler-utils)")
    path = tmp_path / "report.pdf"
    path.write_bytes(pdf)
    run = subprocess.run(["pdftotext", "-layout", path, "-"], check=True, capture_output=True, text=True)
    for text in ("Case 2026-0417", "58.3°", "−25.5 to −21.1°", "not a medical device", "Calibrate again"):
        assert text in run.stdout


@pytest.mark.parametrize(
    "page",
    [
        '<img src="http://192.0.2.1/x.png">',
        '<img src="file:///etc/passwd">',
        '<link rel="stylesheet" href="https://192.0.2.1/x.css">',
        "<style>@import 'file:///etc/hostname';</style>",
        '<p style="background:url(ftp://192.0.2.1/x)">x</p>',
    ],
)
def test_a_page_that_refers_outside_is_refused_without_being_fetched(page: str) -> None:
    with pytest.raises(ExternalReferenceError, match="refers to"):
        to_pdf(f"<!doctype html><html lang=en><title>x</title><body>{page}</body></html>")


def test_data_may_be_in_the_page() -> None:
    assert to_pdf(
        f'<!doctype html><html lang=en><title>x</title><body><img alt="x" src="{PIXEL}"></body></html>'
    )


def test_a_truncated_image_is_refused_after_a_report() -> None:
    script = (
        "from PIL import ImageFile\n"
        "from reports.pdf import to_pdf\n"
        "to_pdf('<!doctype html><html lang=en><title>x</title><body>x</body></html>')\n"
        "print(ImageFile.LOAD_TRUNCATED_IMAGES)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=PROJECT, check=True, capture_output=True, text=True
    )
    assert run.stdout.strip() == "False"


def test_without_weasyprint_the_error_says_what_to_install() -> None:
    script = (
        "import sys; sys.modules['weasyprint'] = None\n"
        "from reports.pdf import to_pdf\n"
        "from spinewatch.errors import MissingPackageError\n"
        "try: to_pdf('')\n"
        "except MissingPackageError as error: print(error.package, '|', error)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=PROJECT, check=True, capture_output=True, text=True
    )
    assert run.stdout.startswith(
        "WeasyPrint with Pango | The PDF report needs WeasyPrint with Pango; install it:"
    )
    assert "pip install spinewatch[pdf]" in run.stdout
    assert "libpango-1.0-0 libpangoft2-1.0-0" in run.stdout


def test_without_pango_the_error_says_what_to_install() -> None:
    script = (
        "import ctypes.util, cffi\n"
        "def dlopen(self, *arguments, **named): raise OSError('cannot load library')\n"
        "cffi.FFI.dlopen = dlopen\n"
        "from reports.pdf import to_pdf\n"
        "from spinewatch.errors import MissingPackageError\n"
        "try: to_pdf('')\n"
        "except MissingPackageError as error: print(error.code)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=PROJECT, check=True, capture_output=True, text=True
    )
    assert run.stdout.strip().endswith("missing-package")
