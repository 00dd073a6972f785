"""Images made to cost much: the API refuses them by name at no cost, and what it cannot see costs one job."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from tests.hostile.attack import harmless, refused
from tests.http.harness import Service, code_of, pair, wait_for
from tests.image_bombs import bombs, chunk, encoded, pixels, png
from tests.spinewatch.imaging.dicom_files import dicom

BOMBS = bombs()
SOUND = encoded("PNG", 91)


def encoded_in_colour(size: tuple[int, int]) -> bytes:
    """Return a file of some 100 kB whose pixels have four bytes each."""
    buffer = BytesIO()
    image = Image.new("RGBA", size, (90, 91, 92, 255))
    image.paste((190, 191, 192, 255), (0, 0, size[0] // 2, size[1]))
    image.save(buffer, "PNG")
    return buffer.getvalue()


def stage_files(left: bytes, right: bytes = SOUND) -> dict[str, Any]:
    return {"left": ("left", left), "right": ("right", right)}


@pytest.fixture(scope="module")
def calibration(service: Service) -> str:
    return service.calibration()


@pytest.mark.parametrize("data", BOMBS.values(), ids=BOMBS)
def test_a_stage_with_a_bomb_is_refused_cheaply(
    service: Service, surgery: str, calibration: str, data: bytes
) -> None:
    form = {"name": "S", "calibration_id": calibration}
    with harmless(service, requests=1 + len(data) // 10_000_000):
        answer = service.client.post(f"/v1/surgeries/{surgery}/stages", data=form, files=stage_files(data))
    assert code_of(answer, 422) == "invalid-image"
    assert service.client.get(f"/v1/surgeries/{surgery}/stages").json()["items"] == []


@pytest.mark.parametrize(
    "name", ["TIFF of 1.2 million strips", "TIFF whose orientation is text", "JPEG of garbage"]
)
def test_shots_with_a_bomb_are_refused_cheaply(service: Service, name: str) -> None:
    data = BOMBS[name]
    with harmless(service, requests=1 + len(data) // 10_000_000):
        shots = service.shoot((data, SOUND))
    assert code_of(shots, 422) == "invalid-image"


def send_radiograph(service: Service, surgery: str, data: bytes) -> httpx.Response:
    form = {"view": "pa", "left_on": "left", "pixel_spacing_mm": "0.143,0.143"}
    path = f"/v1/surgeries/{surgery}/radiographs"
    return service.client.post(path, data=form, files={"image": ("image", data)})


@pytest.mark.parametrize("data", BOMBS.values(), ids=BOMBS)
def test_a_radiograph_that_is_a_bomb_is_refused_cheaply(service: Service, surgery: str, data: bytes) -> None:
    with harmless(service, requests=1 + len(data) // 10_000_000):
        answer = send_radiograph(service, surgery, data)
    assert code_of(answer, 422) == "invalid-image"
    assert service.client.get(f"/v1/surgeries/{surgery}/radiographs").json()["items"] == []


def noise() -> bytes:
    """Return a radiograph that is nearly as large as an upload may be."""
    return dicom(np.random.default_rng(1).integers(0, 256, (5600, 5600), dtype=np.uint8))


LARGE = {
    "31 million pixels of noise": noise(),
    "31 million coloured pixels": encoded_in_colour((5600, 5600)),
    "60 million pixels": encoded("PNG", 90, (7746, 7746)),
    "31 million damaged pixels": png(chunk(b"IDAT", b"\0" * 100), chunk(b"IEND"), size=(5600, 5600)),
}


@pytest.mark.parametrize("data", LARGE.values(), ids=LARGE)
def test_what_a_large_radiograph_costs_is_not_the_servers(service: Service, data: bytes) -> None:
    surgery = service.surgery()
    with harmless(service, requests=1 + len(data) // 4_000_000):  # it is stored, too
        answer = send_radiograph(service, surgery, data)
    assert answer.status_code == 201 or refused(service, answer)


def test_radiographs_that_come_together_are_decoded_in_turns(service: Service) -> None:
    surgery = service.surgery()
    data = encoded_in_colour((5600, 5600))
    with ThreadPoolExecutor(12) as pool, harmless(service, requests=12):
        answers = list(pool.map(lambda _: send_radiograph(service, surgery, data), range(12)))
    assert {answer.status_code for answer in answers} == {201}


@pytest.fixture(scope="module")
def working(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service with one worker, whose jobs have little time and memory."""
    with Service(
        tmp_path_factory.mktemp("working"),
        SPINEWATCH_MAX_CPU_SECONDS="5",
        SPINEWATCH_WORKER_MEMORY_BYTES=str(1 << 30),
    ) as service:
        service.start("worker")
        wait_for(lambda: service.logged("worker_ready"), "the worker")
        yield service


def ended(service: Service, job: str) -> dict[str, Any]:
    for _ in range(10):  # a busy machine
        try:
            return service.finished(job)
        except AssertionError:
            continue
    raise AssertionError(f"the job did not end: {service.job(job)}")


def still_works(service: Service) -> bool:
    """Return whether the one worker is the same as at the start, and measures."""
    job = service.submit(service.surgery(), "after", pair("PRE"), service.calibration())
    ready = sum("worker_ready" in line for line in service.log.read_text().splitlines())
    return ended(service, job)["state"] == "succeeded" and ready == 1


def flat(gray: int) -> bytes:
    """Return a file of 60 kB whose 64 million pixels need 64 MB."""
    return encoded("PNG", gray, (8000, 8000))


def damaged(width: int, height: int) -> bytes:
    """Return a file whose pixels are no compressed data."""
    return png(chunk(b"IDAT", b"\0" * 100), chunk(b"IEND"), size=(width, height))


SHOTS = {
    "64 million pixels": (flat(90), flat(91)),
    "64 million damaged pixels": (damaged(8000, 8000), damaged(8000, 7999)),
    "truncated": (SOUND[: len(SOUND) // 2], encoded("PNG", 7)),
    "no image data": (png(pixels((5, 5)), chunk(b"IEND")), encoded("PNG", 7)),
}


@pytest.mark.parametrize("shot", SHOTS.values(), ids=SHOTS)
def test_what_only_decoding_shows_fails_once_by_name(working: Service, shot: tuple[bytes, bytes]) -> None:
    with harmless(working, requests=4):  # with the polling
        answer = working.shoot(shot)
        job = answer.headers["Location"].removeprefix("/v1/jobs/") if answer.status_code == 202 else None
    if job is None:
        refused(working, answer)
        return
    done = ended(working, job)
    assert done["state"] == "failed"
    assert done["attempts"] == 1
    code = done["error"]["type"].removeprefix("urn:spinewatch:problem:")
    assert code in {"invalid-image", "targets-not-found", "job-overdue", "job-out-of-memory"}
    assert still_works(working)


def test_noise_that_looks_like_balls_does_not_hold_a_worker(working: Service) -> None:
    random = np.random.default_rng(3)
    dots = np.kron(random.integers(0, 2, (104, 142), dtype=np.uint8) * 200 + 20, np.ones((4, 4), np.uint8))

    def file(gray: np.ndarray[Any, Any]) -> bytes:
        buffer = BytesIO()
        Image.fromarray(gray.astype(np.uint8)).save(buffer, "PNG")
        return buffer.getvalue()

    images = file(dots), file(np.roll(dots, 5, 1))
    job = working.submit(working.surgery(), "dots", images, working.calibration())
    assert ended(working, job)["attempts"] == 1
    assert still_works(working)
