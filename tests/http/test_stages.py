"""Submitting stereo pairs: all or nothing, takes, formats."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from tests.http.harness import RIG, Pair, Service, code_of, pair, problem_of

STORED = """
    SELECT (SELECT count(*) FROM stages), (SELECT count(*) FROM jobs),
           (SELECT count(*) FROM images), (SELECT count(*) FROM events)
"""


def gray(content: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(content)).convert("L"))


def encoded(pixels: np.ndarray, kind: str, **options: object) -> bytes:
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, kind, **options)
    return out.getvalue()


def sun_raster(pixels: np.ndarray) -> bytes:
    height, width = pixels.shape
    assert width % 2 == 0  # rows are padded to 16 bits
    return struct.pack(">8I", 0x59A66A95, width, height, 8, pixels.size, 1, 0, 0) + pixels.tobytes()


def as_kind(images: Pair, kind: str) -> Pair:
    def convert(content: bytes) -> bytes:
        pixels = gray(content)
        if kind == "16-bit PNG":
            return encoded(pixels.astype(np.uint16) * 257, "PNG")
        if kind == "Sun raster":
            return sun_raster(pixels)
        if kind == "JPEG":
            return encoded(pixels, "JPEG", quality=95)
        return encoded(pixels, kind)

    return convert(images[0]), convert(images[1])


def test_an_accepted_stage_is_queued_with_its_hashes(
    service: Service, surgery: str, calibration: str
) -> None:
    answer = service.send(surgery, "PRE", pair("PRE"), calibration, "2026-11-21T10:30:00+01:00")
    assert answer.status_code == 202
    stage = answer.json()
    assert answer.headers["Location"] == f"/v1/jobs/{stage['job']['id']}"
    assert stage["captured_at"] == "2026-11-21T09:30:00Z"
    assert stage["state"] == "queued"
    assert stage["triads"] is None
    assert len(stage["images"]["left"]["sha256"]) == 64
    service.finished(stage["job"]["id"])


def test_a_name_in_use_is_refused_and_nothing_is_stored(
    service: Service, surgery: str, calibration: str
) -> None:
    job = service.submit(surgery, "PRE", pair("PRE"), calibration)
    service.finished(job)
    before = service.sql(STORED)
    assert code_of(service.send(surgery, "PRE", pair("POST"), calibration), 409) == "stage-exists"
    assert service.sql(STORED) == before


def test_the_same_image_is_stored_once(service: Service, surgery: str, calibration: str) -> None:
    count = "SELECT count(*) FROM images"
    service.finished(service.submit(surgery, "A", pair("PRE"), calibration))
    before = service.sql(count)
    service.finished(service.submit(surgery, "B", pair("PRE"), calibration))
    assert service.sql(count) == before


def test_a_failed_stage_may_be_taken_again(service: Service, surgery: str, calibration: str) -> None:
    left, right = pair("PRE")
    broken = left[: len(left) // 2]
    failed = service.finished(service.submit(surgery, "PRE", (broken, right), calibration))
    assert failed["state"] == "failed"
    assert failed["attempts"] == 1
    assert failed["error"]["type"] == "urn:spinewatch:problem:invalid-image"
    stage = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE")
    assert stage.json()["state"] == "failed"
    assert (
        code_of(service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/triads"), 409) == "stage-not-measured"
    )

    again = service.send(surgery, "PRE", (left, right), calibration)
    assert again.json()["take"] == 2
    assert service.finished(again.json()["job"]["id"])["state"] == "succeeded"
    takes = service.client.get(f"/v1/surgeries/{surgery}/stages").json()["items"]
    assert [(take["take"], take["state"]) for take in takes] == [(2, "succeeded"), (1, "failed")]
    assert service.client.get(f"/v1/surgeries/{surgery}/stages/PRE").json()["take"] == 2


@pytest.mark.parametrize(
    ("kind", "media_type"),
    [
        ("16-bit PNG", "image/png"),
        ("TIFF", "image/tiff"),
        ("JPEG", "image/jpeg"),
        ("Sun raster", "image/x-sun-raster"),
    ],
)
def test_every_image_format_is_measured(
    service: Service, surgery: str, calibration: str, kind: str, media_type: str
) -> None:
    job = service.submit(surgery, "PRE", as_kind(pair("PRE"), kind), calibration)
    assert service.finished(job)["state"] == "succeeded"
    stage = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE").json()
    assert stage["images"]["left"]["media_type"] == media_type
    assert stage["triads"] >= 3


def test_the_orientation_in_a_jpeg_is_ignored(service: Service, calibration: str) -> None:
    exif = Image.Exif()
    exif[274] = 6  # to be turned by 90 degrees
    plain: list[bytes] = []
    turned: list[bytes] = []
    for content in pair("PRE"):
        plain.append(encoded(gray(content), "JPEG", quality=95))
        turned.append(encoded(gray(content), "JPEG", quality=95, exif=exif))
    results = []
    for images in (plain, turned):
        surgery = service.surgery()
        service.finished(service.submit(surgery, "PRE", (images[0], images[1]), calibration))
        results.append(service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/triads").json()["triads"])
    assert results[0] == results[1] != []


def png_header(width: int, height: int) -> bytes:
    """A PNG that only claims its size."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(b""))
        + chunk(b"IEND", b"")
    )


def several_frames() -> bytes:
    out = io.BytesIO()
    frames = [Image.fromarray(np.full((416, 568), value, np.uint8)) for value in (10, 200)]
    frames[0].save(out, "TIFF", save_all=True, append_images=frames[1:])
    return out.getvalue()


BAD_IMAGES = {
    "empty": b"",
    "text": b"not an image at all",
    "gif": b"GIF89a" + bytes(100),
    "bomb": png_header(60_000, 60_000),
    "several frames": several_frames(),
    "other size": encoded(np.zeros((100, 200), np.uint8), "PNG"),
}


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("bad", BAD_IMAGES)
def test_a_bad_image_is_refused_by_its_header(
    service: Service, surgery: str, calibration: str, bad: str, side: str
) -> None:
    left, right = pair("PRE")
    images = (BAD_IMAGES[bad], right) if side == "left" else (left, BAD_IMAGES[bad])
    before = service.sql(STORED)
    problem = problem_of(service.send(surgery, "PRE", images, calibration), 422)
    code = "image-size-mismatch" if bad == "other size" else "invalid-image"
    assert problem["type"].endswith(code)
    assert problem["errors"][0]["loc"] == ["body", side]
    if bad == "other size":
        assert "200 x 100" in problem["detail"]
        assert "568 x 416" in problem["detail"]
    assert service.sql(STORED) == before


def test_left_and_right_must_differ(service: Service, surgery: str, calibration: str) -> None:
    left, _ = pair("PRE")
    assert code_of(service.send(surgery, "PRE", (left, left), calibration), 422) == "same-image-twice"


@pytest.mark.parametrize(
    "captured_at",
    [
        "yesterday",
        "2026-11-21",
        "2026-11-21T09:30:00",
        "1795253400",
        "2026-13-41T09:30:00Z",
        "0001-01-01T00:00:00+14:00",
    ],
)
def test_a_time_without_zone_or_sense_is_refused(
    service: Service, surgery: str, calibration: str, captured_at: str
) -> None:
    answer = service.send(surgery, "PRE", pair("PRE"), calibration, captured_at)
    assert problem_of(answer, 422)["errors"][0]["loc"] == ["body", "captured_at"]


@pytest.mark.parametrize("captured_at", ["1970-01-01T00:00:00Z", "2099-06-01T10:00:00Z"])
def test_an_implausible_time_is_refused(
    service: Service, surgery: str, calibration: str, captured_at: str
) -> None:
    answer = service.send(surgery, "PRE", pair("PRE"), calibration, captured_at)
    assert code_of(answer, 422) == "time-implausible"
    assert problem_of(answer, 422)["errors"][0]["loc"] == ["body", "captured_at"]


def test_a_time_with_seven_decimals_is_cut(service: Service, surgery: str, calibration: str) -> None:
    answer = service.send(surgery, "PRE", pair("PRE"), calibration, "2026-11-21T09:30:00.1234567Z")
    assert answer.json()["captured_at"] == "2026-11-21T09:30:00.123456Z"


@pytest.mark.parametrize("name", ["", " ", "a/b", "../x", "é", "x" * 65, "-PRE"])
def test_a_name_that_is_no_path_segment_is_refused(
    service: Service, surgery: str, calibration: str, name: str
) -> None:
    assert code_of(service.send(surgery, name, pair("PRE"), calibration), 422) == "invalid-request"


def test_unknown_surgery_and_calibration(service: Service, surgery: str, calibration: str) -> None:
    assert code_of(service.send("none", "PRE", pair("PRE"), calibration), 404) == "surgery-not-found"
    assert code_of(service.send(surgery, "PRE", pair("PRE"), "none"), 422) == "calibration-not-found"


def test_parts_that_are_missing_or_unknown_are_named(
    service: Service, surgery: str, calibration: str
) -> None:
    url = f"/v1/surgeries/{surgery}/stages"
    left, right = pair("PRE")
    fields = {"name": "PRE", "calibration_id": calibration}

    def invalid_fields(fields: dict[str, str], files: dict[str, bytes]) -> list[str]:
        answer = service.client.post(url, data=fields, files=files)
        return [error["loc"][-1] for error in problem_of(answer, 422)["errors"]]

    assert invalid_fields(fields, {"left": left}) == ["right"]
    assert invalid_fields({}, {"left": left, "right": right}) == ["name", "calibration_id"]
    assert invalid_fields({**fields, "patient": "x"}, {"left": left, "right": right}) == ["patient"]


def test_another_rig_is_checked_against_its_own_size(service: Service, surgery: str) -> None:
    other = {**RIG, "left": {**RIG["left"], "image_size_px": [640, 480]}}
    calibration = service.calibration(other)
    problem = problem_of(service.send(surgery, "PRE", pair("PRE"), calibration), 422)
    assert problem["errors"][0]["loc"] == ["body", "left"]
    assert "640 x 480" in problem["detail"]
