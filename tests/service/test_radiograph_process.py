"""A radiograph is decoded apart: the same result, and an end by name for what takes too much."""

from __future__ import annotations

import os
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from tempfile import SpooledTemporaryFile

import numpy as np
import pytest
from fastapi import HTTPException
from PIL import Image

from service.radiograph_process import ProcessLimits, RadiographTooCostlyError, read_apart
from spinewatch.errors import ImageError
from spinewatch.imaging.radiograph_image import RadiographImage, read_radiograph
from tests.http.harness import wait_for
from tests.spinewatch.imaging.dicom_files import dicom

GRAY = np.arange(60, dtype=np.uint16).reshape(6, 10) * 999
_PARENT = """
import sys
from service.radiograph_process import read_apart
with open(sys.argv[1], "rb") as file:
    read_apart(file)
"""


def png(pixels: np.ndarray) -> bytes:
    buffer = BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG", compress_level=1)
    return buffer.getvalue()


def noise() -> bytes:
    """Return a file of 25 million pixels that takes seconds to compress again."""
    return dicom(np.random.default_rng(1).integers(0, 256, (5000, 5000), dtype=np.uint8))


def read(content: bytes, limits: ProcessLimits | None = None) -> RadiographImage:
    with SpooledTemporaryFile(max_size=1 << 20) as file:
        file.write(content)
        return read_apart(file, limits)


@pytest.mark.parametrize("content", [png(GRAY), dicom(GRAY), dicom(GRAY, PixelSpacing=None)])
def test_the_result_is_that_of_decoding_here(content: bytes) -> None:
    assert vars(read(content)) == vars(read_radiograph(content))


@pytest.mark.parametrize("content", [b"", b"text", png(GRAY)[:50], dicom(GRAY, Rows=99), dicom(GRAY)[:200]])
def test_an_error_keeps_its_code_and_sentence(content: bytes) -> None:
    with pytest.raises(ImageError) as here:
        read_radiograph(content)
    with pytest.raises(ImageError) as apart:
        read(content)
    assert (apart.value.code, str(apart.value)) == (here.value.code, str(here.value))


@pytest.mark.parametrize(
    ("content", "limits"),
    [
        (noise(), ProcessLimits(cpu_seconds=1)),
        (png(np.full((5600, 5600, 4), 7, np.uint8)), ProcessLimits(memory_bytes=300 << 20)),
    ],
    ids=["CPU time", "memory"],
)
def test_what_takes_too_much_is_named(content: bytes, limits: ProcessLimits) -> None:
    with pytest.raises(RadiographTooCostlyError, match="smaller") as error:
        read(content, limits)
    assert error.value.code == "radiograph-too-costly"


def test_a_busy_machine_is_no_fault_of_the_file() -> None:
    with pytest.raises(HTTPException) as error:
        read(png(GRAY), ProcessLimits(seconds=0.001))
    assert error.value.status_code == 503
    assert "Retry-After" in (error.value.headers or {})


_RUNS = b"-m\0service.radiograph_process"  # the name alone is in the command of the parent too, which it begins as


def test_the_process_knows_no_settings_and_ends_with_the_server(tmp_path: Path) -> None:
    file = tmp_path / "noise.dcm"
    file.write_bytes(noise())
    settings = {**os.environ, "SPINEWATCH_DATABASE_URL": "postgresql://secret"}
    parent = subprocess.Popen([sys.executable, "-c", _PARENT, str(file)], env=settings)

    def child() -> int | None:
        found = Path(f"/proc/{parent.pid}/task/{parent.pid}/children").read_text().split()
        started = [pid for pid in found if _RUNS in Path(f"/proc/{pid}/cmdline").read_bytes()]
        return int(started[0]) if started else None

    pid = wait_for(child, "the process", 0.005)
    assert b"SPINEWATCH" not in Path(f"/proc/{pid}/environ").read_bytes()
    parent.kill()
    parent.wait()
    wait_for(lambda: not Path(f"/proc/{pid}").exists(), "the end of the process")
