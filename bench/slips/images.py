"""Slips of exposure, optics, transfer and file format: ``process`` of sample stages in other images."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bench.slips.slip import Answer, Kind, Right, Slip
from bench.slips.sound import (
    SIDES,
    changed_rig,
    each_camera,
    process_arguments,
    stage_files,
    stage_pixels,
    write_png,
    write_rig,
)

Array = NDArray[Any]
_HALF_PX_MM = 0.005
_SPOILT = 0.03  # of the pixels


def slips() -> Iterator[Slip]:
    """Yield the slips of images."""
    yield from _quality()
    yield from _damaged_jpeg()
    yield from _formats()


def measured_well(answer: Answer) -> bool:
    """Return whether all four triads are given, within 4 deviations of the truth, and no advice misleads."""
    document = answer.document
    return (
        len(document.get("triads", ())) == 4
        and document.get("off_sd", np.inf) < 4
        and not answer.codes & {"image-dark", "image-saturated", "blank-image"}
    )


def _quality() -> Iterator[Slip]:
    compressed = Right(refusal=r"JPEG|compress", flags=("image-compressed",))
    for stage, quality in (("PRE", 60), ("INTER", 40), ("POST", 20)):
        yield _encoded(f"JPEG of quality {quality}", "image", stage, _jpeg(quality), compressed)
    yield _changed(
        "JPEG of quality 40, saved again as PNG", "image", "PRE", _through_jpeg, _through_jpeg, compressed
    )
    unequal = Right(flags=("exposure-unequal", "image-dark", "image-saturated"))
    for stage, share in (("PRE", 0.3), ("POST", 0.5)):
        yield _changed(f"right exposed by {share:g}", "exposure", stage, _same, _scaled(share), unequal)
    dark = Right(flags=("image-dark",))
    yield _changed("both exposed by 0.06", "exposure", "INTER", _scaled(0.06), _scaled(0.06), dark)
    bright = Right(flags=("image-saturated",))
    yield _changed("both exposed by 4", "exposure", "INTER", _scaled(4.0), _scaled(4.0), bright)
    yield _changed(
        "shown negative",
        "exposure",
        "PRE",
        _negative,
        _negative,
        Right(refusal=r"negative", flags=("no-triads", "image-negative")),
    )
    blurred = Right(flags=("image-blurred",))
    yield _changed("motion of 7 px while exposing", "image", "PRE", _motion(7), _motion(7), blurred)
    yield _changed("motion of 9 px in one view", "image", "POST", _same, _motion(9), blurred)
    yield _changed("defocus of 2.5 px", "image", "INTER", _defocus(2.5), _defocus(2.5), blurred)
    yield _changed("defocus of 2 px in one view", "image", "PRE", _defocus(2.0), _same, blurred)
    banded = Right(flags=("image-banded",))
    mild = Right(flags=("image-banded",), sound=measured_well)
    yield _changed("rolling bands of 25%", "exposure", "PRE", _bands(0.25), _bands(0.25), mild)
    yield _changed("rolling bands of 50% in one view", "exposure", "POST", _same, _bands(0.5), banded)
    interlaced = Right(flags=("image-interlaced",))
    yield _changed("one field of an interlaced frame", "image", "INTER", _one_field, _one_field, interlaced)
    yield _changed("fields 4 px apart", "image", "PRE", _fields_apart(4), _fields_apart(4), interlaced)
    yield _changed("fields 2 px apart in one view", "image", "POST", _same, _fields_apart(2), interlaced)
    coarse = Right(flags=("image-coarse",), sound=measured_well)
    yield _changed("16 gray levels", "image", "PRE", _levels(16), _levels(16), coarse)
    noise = Right(flags=("image-noisy",), sound=measured_well)
    yield _changed("noise of 12 levels", "image", "INTER", _noise(12, 3), _noise(12, 4), noise)


def _damaged_jpeg() -> Iterator[Slip]:
    damaged = Right(refusal=r"damaged|incomplete|corrupt", flags=("image-damaged",))
    yield _encoded(
        "JPEG without its last 9 bytes", "image", "PRE", lambda i: _jpeg(92)(i)[:-9], damaged, one=True
    )
    yield _encoded("JPEG with 40 bytes missing", "image", "POST", _without_some, damaged, one=True)
    for stage, share in (("PRE", 0.35), ("INTER", 0.5), ("POST", 0.62)):
        yield _encoded(
            f"JPEG with a flipped bit at {share:.0%}", "image", stage, _flipped(share), damaged, one=True
        )
    yield _encoded(
        "PNG cut in half",
        "image",
        "PRE",
        lambda image: _png(image)[: len(_png(image)) // 2],
        damaged,
        one=True,
    )


def _formats() -> Iterator[Slip]:
    white = Right(refusal=r"white", flags=("no-triads",), detail=r"white|negative", sound=measured_well)
    yield _encoded(
        "16-bit TIFF with white as zero", "image", "PRE", lambda i: _tiff(65535 - _wide(i), 0), white
    )
    yield _encoded("8-bit TIFF with white as zero", "image", "POST", _white_is_zero_8, white)
    signed = Right(refusal=r"signed", sound=measured_well)
    yield _encoded(
        "signed 16-bit TIFF",
        "image",
        "INTER",
        lambda i: _tiff((_wide(i) >> 1).astype(np.int16), 1, 2),
        signed,
    )
    read = Right(refusal=r"Sun|run.length", sound=measured_well)
    yield _odd_sun("Sun raster with run lengths at odd width", "PRE", read)
    depth = Right(refusal=r"12.bit|16.bit|bits", flags=("image-coarse", "image-depth"), sound=measured_well)
    yield _encoded("12 bits in 16-bit colour", "image", "INTER", _colour_12, depth)
    yield _encoded(
        "12 bits in 16 bits", "image", "PRE", lambda i: _png(_wide(i) >> 4), Right(sound=measured_well)
    )
    hot = Right(flags=("pixel-defect",), sound=measured_well)
    for stage in ("PRE", "POST"):
        yield _encoded("one hot pixel in a 12-bit image", "image", stage, _hot, hot)
    dead = Right(flags=("pixel-defect", "image-damaged", "triad-count-low"))
    yield _changed("a row of blocks lost", "image", "POST", _same, _lost_rows, dead)
    torn = Right(flags=("image-damaged",))
    for stage, row, shift in (("PRE", 207, 4), ("INTER", 213, -2), ("POST", 206, 5)):
        name = f"rows displaced by {shift:+d} px from row {row} on in one view"
        yield _changed(name, "image", stage, _same, _displaced(row, shift), torn)
    band = _displaced(170, 7, 210)
    yield _changed("a band of 40 rows displaced by 7 px in one view", "image", "POST", band, _same, torn)
    size = Right(refusal=r"\d+ ?x ?\d+")
    yield _changed("images of half the size", "image", "PRE", _half, _half, size)


def _changed(
    name: str,
    kind: Kind,
    stage: str,
    left: Callable[[Array], Array],
    right: Callable[[Array], Array],
    answer: Right,
) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        images = [
            write_png(folder / f"{side}.png", change(image))
            for side, image, change in zip(SIDES, stage_pixels(stage), (left, right), strict=True)
        ]
        return process_arguments(images)

    return Slip(f"{name}, {stage}", kind, stage, "process", answer, make)


def _encoded(
    name: str, kind: Kind, stage: str, encode: Callable[[Array], bytes], answer: Right, one: bool = False
) -> Slip:
    """Return the slip of a stage whose images, or with ``one`` the right one alone, are encoded otherwise."""

    def make(folder: Path) -> Sequence[object]:
        images = list(stage_files(stage))
        for number, (side, image) in enumerate(zip(SIDES, stage_pixels(stage), strict=True)):
            if one and side == "left":
                continue
            images[number] = folder / f"{side}.img"
            images[number].write_bytes(encode(image))
        return process_arguments(images)

    return Slip(f"{name}, {stage}", kind, stage, "process", answer, make)


def _odd_sun(name: str, stage: str, answer: Right) -> Slip:
    """Return the slip of a stage without its last column, in rasters that pad rows to 16 bits before packing."""

    def make(folder: Path) -> Sequence[object]:
        images = []
        for side, image in zip(SIDES, stage_pixels(stage), strict=True):
            images.append(folder / f"{side}.ras")
            images[-1].write_bytes(_sun_run_lengths(image[:, :-1]))
        narrower = changed_rig(each_camera("image_size_px", lambda size: [size[0] - 1, size[1]]))
        for side in SIDES:
            narrower[side]["principal_point_mm"][0] += _HALF_PX_MM
        return process_arguments(images, write_rig(folder, narrower))

    return Slip(f"{name}, {stage}", "image", stage, "process", answer, make)


def _same(image: Array) -> Array:
    return image


def _scaled(factor: float) -> Callable[[Array], Array]:
    return lambda image: factor * image.astype(np.float64)


def _negative(image: Array) -> Array:
    return 255 - image


def _noise(sd: float, seed: int) -> Callable[[Array], Array]:
    return lambda image: image + np.random.default_rng(seed).normal(0.0, sd, image.shape)


def _levels(count: int) -> Callable[[Array], Array]:
    step = 256 // count
    return lambda image: image // step * step + step // 2


def _half(image: Array) -> Array:
    return image[::2, ::2]


def _motion(length: int) -> Callable[[Array], Array]:
    kernel = np.full((1, length), 1 / length)
    return lambda image: np.asarray(cv2.filter2D(image.astype(np.float64), -1, kernel))


def _defocus(sigma: float) -> Callable[[Array], Array]:
    return lambda image: np.asarray(cv2.GaussianBlur(image.astype(np.float64), (0, 0), sigma))


def _bands(share: float) -> Callable[[Array], Array]:
    def change(image: Array) -> Array:
        rows = np.arange(image.shape[0])[:, None]
        return np.asarray(image * (1 + share * np.sin(2 * np.pi * rows / 83.2)) / (1 + share))

    return change


def _one_field(image: Array) -> Array:
    return np.repeat(image[::2], 2, axis=0)


def _fields_apart(shift: int) -> Callable[[Array], Array]:
    def change(image: Array) -> Array:
        woven = image.copy()
        woven[1::2] = np.roll(image[1::2], shift, axis=1)
        return woven

    return change


def _lost_rows(image: Array) -> Array:
    broken = image.copy()
    broken[200:216, 120:440] = 128
    return broken


def _displaced(start: int, shift: int, end: int | None = None) -> Callable[[Array], Array]:
    def change(image: Array) -> Array:
        torn = image.copy()
        torn[start:end] = np.roll(image[start:end], shift, axis=1)
        return torn

    return change


def _through_jpeg(image: Array) -> Array:
    return np.array(Image.open(io.BytesIO(_jpeg(40)(image))).convert("L"))


def _jpeg(quality: int) -> Callable[[Array], bytes]:
    def encode(image: Array) -> bytes:
        out = io.BytesIO()
        Image.fromarray(image).save(out, "JPEG", quality=quality)
        return out.getvalue()

    return encode


def _flipped(share: float) -> Callable[[Array], bytes]:
    """Return an encoder that flips one bit, the first after a share of the file that spoils many pixels unnoticed."""

    def encode(image: Array) -> bytes:
        sound = _jpeg(92)(image)
        whole = _decoded(sound)
        for place in range(int(share * len(sound)), len(sound) - 2):
            data = bytearray(sound)
            data[place] ^= 0x10
            if 0xFF in (*sound[place - 1 : place + 2], data[place]):
                continue
            spoilt = _decoded(bytes(data))
            if spoilt is not None and whole is not None and np.mean(np.abs(spoilt - whole) > 8) > _SPOILT:
                return bytes(data)
        raise ValueError("no bit spoils the image unnoticed")

    return encode


def _decoded(data: bytes) -> NDArray[np.float64] | None:
    """Return the gray levels of a JPEG, None when Pillow refuses it."""
    try:
        return np.array(Image.open(io.BytesIO(data)).convert("L"), dtype=np.float64)
    except OSError:
        return None


def _without_some(image: Array) -> bytes:
    data = _jpeg(92)(image)
    middle = len(data) // 2
    return data[:middle] + data[middle + 40 :]


def _png(image: Array) -> bytes:
    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG")
    return out.getvalue()


def _wide(image: Array) -> NDArray[np.uint16]:
    return image.astype(np.uint16) * 257


def _hot(image: Array) -> bytes:
    twelve = _wide(image) >> 4
    twelve[40, 60] = 65535
    return _png(twelve)


def _colour_12(image: Array) -> bytes:
    twelve = _wide(image) >> 4
    return bytes(cv2.imencode(".png", np.dstack([twelve] * 3))[1])


def _white_is_zero_8(image: Array) -> bytes:
    return _tiff(255 - image, 0)


def _tiff(image: Array, photometric: int, sample_format: int = 1) -> bytes:
    """Return an uncompressed little-endian TIFF of one strip; photometric 0: white is zero."""
    height, width = image.shape
    data = image.astype(image.dtype.newbyteorder("<")).tobytes()
    entries = (
        (256, 4, width),
        (257, 4, height),
        (258, 3, 8 * image.dtype.itemsize),
        (259, 3, 1),
        (262, 3, photometric),
        (273, 4, 8),
        (277, 3, 1),
        (278, 4, height),
        (279, 4, len(data)),
        (339, 3, sample_format),
    )
    directory = struct.pack("<H", len(entries))
    directory += b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in entries)
    return b"II*\0" + struct.pack("<I", 8 + len(data)) + data + directory + b"\0\0\0\0"


def _sun_run_lengths(image: Array) -> bytes:
    """Return a Sun raster of type 2, whose rows are padded to 16 bits before they are packed."""
    height, width = image.shape
    padded = np.pad(image, ((0, 0), (0, width % 2)))
    packed = bytearray()
    flat = padded.ravel()
    starts = np.flatnonzero(np.r_[True, flat[1:] != flat[:-1]])
    for start, length in zip(starts, np.diff(np.r_[starts, len(flat)]), strict=True):
        value, left = int(flat[start]), int(length)
        while left:
            run = min(left, 256)
            if run > 2 or value == 0x80:
                packed += bytes((0x80, run - 1, value)) if run > 1 else bytes((0x80, 0))
            else:
                packed += bytes((value,)) * run
            left -= run
    header = struct.pack(">8I", 0x59A66A95, width, height, 8, len(packed), 2, 0, 0)
    return header + bytes(packed)
