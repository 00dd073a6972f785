"""Checks of a stage against the record: repeated images, times, an old calibration, views apart in time, parameters.

Images and times are compared with those of the earlier stages of its surgery.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from spinewatch.arrays import Pixels
from spinewatch.camera import Rig
from spinewatch.errors import ImageError
from spinewatch.flags import Flag
from spinewatch.imaging.comparison import (
    ComparisonParameters,
    ImageComparison,
    compare_images,
    may_be_equal,
    may_be_repeated,
    textured_strip,
)
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Frame, Side
from spinewatch.tracking.synchronization import SynchronizationParameters, delay_flags, parallax_gain
from store.stage_work import EarlierStage, StageWork
from workers.registry import FilesWantedError
from workers.stage_burst import view_delay_s
from workers.stage_revision import Changed, changes_text
from workers.strips import unpacked

_IDENTICAL = ImageComparison(exact=True, repeated=True, noise_gray=0.0, displacement_px=0.0)
_OTHER: Mapping[Side, Side] = {"left": "right", "right": "left"}


@dataclass(frozen=True)
class _Repetition:
    """An image that shows that of an earlier stage again."""

    stage: str
    comparison: ImageComparison


def require_files(
    work: StageWork, pixels: Mapping[Side, Pixels], parameters: ComparisonParameters | None = None
) -> None:
    """Ask for the images of earlier stages that may be repeated or mixed, as far as strips show, unless that was done.

    Parameters
    ----------
    work
        The stage and the earlier ones.
    pixels
        Gray levels of its images, shape (H, W), by side.
    parameters
        Parameters of the comparison.

    Raises
    ------
    FilesWantedError
        Some are to be compared.
    """
    if work.files is not None:
        return
    wanted = {
        stage.sha256[side]
        for stage in work.earlier
        if stage.is_compared
        for side in SIDES
        if _is_in_doubt(stage, side, pixels, parameters)
    }
    if wanted:
        raise FilesWantedError(frozenset(wanted))


def repetition_flags(
    work: StageWork, pixels: Mapping[Side, Pixels], parameters: ComparisonParameters | None = None
) -> Iterator[Flag]:
    """Yield a flag when an image of an earlier stage was sent again, exactly or all but noise.

    Files are compared with those of all earlier stages, gray levels with those of the files that were asked for.

    Parameters
    ----------
    work
        The stage and the earlier ones, with the files for which `require_files` asked.
    pixels
        Gray levels of its images, shape (H, W), by side.
    parameters
        Parameters of the comparison.

    Yields
    ------
    Flag
        ``frame-repeated`` for a side that repeats itself, ``pair-mixed`` for an image that was sent as the other side.
    """
    shown = _decoded(work.files or {})
    earlier = [(stage, _by_side(stage, shown)) for stage in reversed(work.earlier)]
    found = {side: _repetition(side, work.sha256[side], pixels[side], earlier, parameters) for side in SIDES}
    repeated = {side: repetition for side, repetition in found.items() if repetition is not None}
    if repeated:
        parts = "; ".join(
            f"the {side} image is that of stage {repetition.stage} again ({_difference(repetition.comparison)})"
            for side, repetition in repeated.items()
        )
        one_side = (
            "" if len(repeated) == len(SIDES) else f", but the {_OTHER[next(iter(repeated))]} one is not"
        )
        yield Flag("frame-repeated", f"{parts}{one_side}; send the images that were taken at this stage")
    for side in SIDES:
        other = _OTHER[side]
        for stage, images in earlier:
            same_file = stage.sha256[other] == work.sha256[side]
            if same_file or (other in images and np.array_equal(images[other], pixels[side])):
                detail = f"the {side} image is the {other} image of stage {stage.name}; send each image as its own side"
                yield Flag("pair-mixed", detail)
                break


def burst_repetition_flags(pairs: Sequence[Mapping[Side, str]]) -> Iterator[Flag]:
    """Yield a flag when a pair of a burst shows an image of an earlier pair again, in another file.

    Parameters
    ----------
    pairs
        Digests of the gray levels by side, one mapping per pair.

    Yields
    ------
    Flag
        ``frame-repeated``, once for all pairs.
    """
    first: dict[tuple[Side, str], int] = {}
    repeated: list[str] = []
    for number, pair in enumerate(pairs, start=1):
        for side, digest in pair.items():
            earlier = first.setdefault((side, digest), number)
            if earlier != number:
                repeated.append(f"the {side} image of pair {number} is that of pair {earlier} again")
    if repeated:
        yield Flag("frame-repeated", f"{'; '.join(repeated)}; send each exposure of the burst once")


def time_flags(work: StageWork, tolerance: timedelta) -> Iterator[Flag]:
    """Yield a flag for each order of times that cannot be.

    Parameters
    ----------
    work
        The stage, its calibration and the earlier stages.
    tolerance
        Largest difference between the clocks that gave the times.

    Yields
    ------
    Flag
        ``time-implausible``: taken before its calibration, before a stage that comes before it, or after one that comes
        after it, of those that were sent earlier.
    """
    captured = work.captured_at
    if captured is None:
        return
    calibrated = work.calibrated_at or work.calibration_created_at
    if captured < calibrated - tolerance:
        how = (
            "was calibrated"
            if work.calibrated_at
            else "was stored, whose own time is unknown: give calibrated_at"
        )
        yield Flag(
            "time-implausible",
            f"the stage was captured {_span(calibrated - captured)} before the rig {how}"
            f" ({_iso(captured)}, {_iso(calibrated)}); check the clocks and the calibration",
        )
    advice = "check the clock, and that the images belong to this stage"
    latest, name = max(_times(work, follows=False), default=(captured, ""))
    if captured < latest - tolerance:
        yield Flag(
            "time-implausible",
            f"the stage was captured {_span(latest - captured)} before stage {name}, which was sent earlier"
            f" ({_iso(captured)}, {_iso(latest)}); {advice}",
        )
    first, name = min(_times(work, follows=True), default=(captured, ""))
    if captured > first + tolerance:
        yield Flag(
            "time-implausible",
            f"the stage was captured {_span(captured - first)} after stage {name}, which comes after its first take"
            f" ({_iso(captured)}, {_iso(first)}); {advice}",
        )


def age_flags(age: timedelta, max_age_days: float) -> Iterator[Flag]:
    """Yield a flag when the calibration of a stage was old.

    Parameters
    ----------
    age
        Age of the calibration when the stage was taken.
    max_age_days
        Largest age, days.

    Yields
    ------
    Flag
        ``calibration-old``.
    """
    days = age / timedelta(days=1)
    if days > max_age_days:
        detail = (
            f"the calibration was {days:.1f} days old when the stage was taken, and at most {max_age_days:g} are"
            " allowed; calibrate before the operation"
        )
        yield Flag("calibration-old", detail)


def view_delay_flags(work: StageWork, rig: Rig, parameters: SynchronizationParameters) -> tuple[Flag, ...]:
    """Return the flags of views that were not exposed together.

    Parameters
    ----------
    work
        The stage, with the times of its exposures.
    rig
        The calibrated cameras.
    parameters
        Limits of the delay.

    Returns
    -------
    tuple of Flag
        The flags; none without times.
    """
    delays = [delay for delay in map(view_delay_s, work.pairs) if delay is not None]
    return delay_flags(delays, parallax_gain(rig), parameters) if delays else ()


def change_flags(changed: Changed) -> Iterator[Flag]:
    """Yield a flag when a stage was measured again with other parameters.

    Parameters
    ----------
    changed
        Values of these parameters and the usual ones.

    Yields
    ------
    Flag
        ``parameters-changed``.
    """
    if changed:
        detail = (
            f"measured with other parameters than usual: {changes_text(changed)}; look at the take before too"
        )
        yield Flag("parameters-changed", detail)


def gray_level_digests(frames: tuple[Frame, Frame]) -> dict[Side, str]:
    """Return digests of the gray levels of both images, for `burst_repetition_flags`.

    Parameters
    ----------
    frames
        The left and the right image.

    Returns
    -------
    dict
        Digests, hexadecimal, by side.
    """
    return {frame.side: hashlib.sha256(frame.pixels.tobytes()).hexdigest() for frame in frames}


def _times(work: StageWork, *, follows: bool) -> list[tuple[datetime, str]]:
    """Return time and name of the earlier stages that come after the stage, or of those that come before it."""
    return [
        (stage.captured_at, stage.name)
        for stage in work.earlier
        if stage.captured_at is not None and stage.follows is follows
    ]


def _is_in_doubt(
    stage: EarlierStage,
    side: Side,
    pixels: Mapping[Side, Pixels],
    parameters: ComparisonParameters | None,
) -> bool:
    """Return whether an image of an earlier stage may be one of the images, or show the same."""
    stored = stage.strips.get(side)
    strip = None if stored is None else unpacked(stored)
    if strip is None:
        return True
    return may_be_repeated(strip, pixels[side], parameters) or may_be_equal(
        strip, pixels[_OTHER[side]], parameters
    )


def _decoded(files: Mapping[str, bytes]) -> dict[str, Pixels]:
    """Return the images that can be decoded, by SHA-256."""
    found = {}
    for sha256, content in files.items():
        with suppress(ImageError):  # its own job failed by this name
            found[sha256] = decode_image(content)
    return found


def _by_side(stage: EarlierStage, shown: Mapping[str, Pixels]) -> dict[str, Pixels]:
    """Return the images of a stage that are compared."""
    return {
        side: shown[sha256] for side, sha256 in stage.sha256.items() if stage.is_compared and sha256 in shown
    }


def _repetition(
    side: Side,
    sha256: str,
    pixels: Pixels,
    earlier: Sequence[tuple[EarlierStage, Mapping[str, Pixels]]],
    parameters: ComparisonParameters | None,
) -> _Repetition | None:
    """Return the first of the stages whose image is repeated; one with the same file goes before any other."""
    for stage, _ in earlier:
        if stage.sha256[side] == sha256:
            return _Repetition(stage.name, _IDENTICAL)
    for stage, images in earlier:
        if side in images and _may_be_repeated(images[side], pixels, parameters):
            comparison = compare_images(images[side], pixels, parameters)
            if comparison.repeated:
                return _Repetition(stage.name, comparison)
    return None


def _may_be_repeated(first: Pixels, second: Pixels, parameters: ComparisonParameters | None) -> bool:
    """Return whether the strip of an image leaves open that another repeats it, whether it is stored or not."""
    strip = textured_strip(first, parameters)
    return strip is None or may_be_repeated(strip, second, parameters)


def _difference(comparison: ImageComparison) -> str:
    if comparison.exact:
        return "all pixels are equal"
    return (
        f"they differ by {comparison.noise_gray:.2g} gray levels of noise, and nothing has moved by more than"
        f" {comparison.displacement_px:.2g} px"
    )


def _span(span: timedelta) -> str:
    hours = span / timedelta(hours=1)
    return (
        f"{hours * 60:.0f} minutes"
        if hours < 2
        else f"{hours:.1f} hours"
        if hours < 48
        else f"{hours / 24:.0f} days"
    )


def _iso(time: datetime) -> str:
    return time.isoformat(timespec="seconds")
