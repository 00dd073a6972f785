"""The form of a stage: a stereo pair or a burst, and what it belongs to."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from contract.base import Identifier, StageName
from contract.measuring import MAX_MARKERS, MarkerText, Measuring, RangeText
from service.forms.images import File, read_image
from service.parameters import TextTime, TimeImplausibleError, require_plausible_time
from service.problems import InvalidInputError
from spinewatch.errors import ImageSizeError, ParameterError, SameImageError, SpinewatchError
from spinewatch.marker_texts import require_possible
from store.images import NewImage
from store.stage_submission import NewPair, NewStage
from store.tables.calibrations import Calibration

MAX_PAIRS = 60
_SIDES = ("left", "right")


class BurstTooLongError(SpinewatchError):
    """A burst has more pairs than are taken."""

    code = "burst-too-long"


class BurstUnequalError(SpinewatchError):
    """The images or times of a burst are not of the same number."""

    code = "burst-unequal"


class StageForm(BaseModel):
    """Parts of the multipart form."""

    model_config = ConfigDict(strict=True, extra="forbid")

    name: StageName
    calibration_id: Annotated[
        Identifier, Field(description="Calibration of the cameras that took the images.")
    ]
    left: Annotated[
        list[File],
        Field(
            min_length=1,
            description="Left image: PNG, TIFF, JPEG or Sun raster; for a burst of 2 to 60 pairs, the part is repeated"
            " in the order in which the images were taken.",
        ),
    ]
    right: Annotated[
        list[File], Field(min_length=1, description="Right image, taken at the same time; repeated likewise.")
    ]
    captured_at: Annotated[
        TextTime | None, Field(description="Time of capture, RFC 3339 with a time zone.")
    ] = None
    left_exposed_at: Annotated[
        list[TextTime],
        Field(
            description="Time of exposure of the left image, RFC 3339 with a time zone and fractions of a second; one"
            " per pair, or none."
        ),
    ] = []
    right_exposed_at: Annotated[
        list[TextTime], Field(description="Time of exposure of the right image; one per pair, or none.")
    ] = []
    retake: Annotated[
        bool,
        Field(
            strict=False,
            description="Whether a stage that was measured is taken again; its takes are all kept.",
        ),
    ] = False
    range_mm: Annotated[
        RangeText | None, Field(description="Nearest and farthest range along the optical axes, mm.")
    ] = None
    marker: Annotated[
        list[MarkerText],
        Field(max_length=MAX_MARKERS, description="Marker in use; the part is repeated, once per kind."),
    ] = []
    refine: Annotated[
        bool | None,
        Field(
            strict=False,
            description="Whether candidates with unlike surroundings are discarded (thesis eq. 5.11).",
        ),
    ] = None
    templates: Annotated[
        str | None, Field(max_length=64, description="Version of the template set of the workers.")
    ] = None

    @property
    def measuring(self) -> Measuring:
        """What is known of the pair, and how it is to be measured."""
        return Measuring(
            range_mm=self.range_mm, markers=self.marker, refine=self.refine, templates=self.templates
        )


def read_stage(form: StageForm, now: datetime, tolerance: timedelta) -> NewStage:
    """Return what was taken, with headers and times checked; raises ``InvalidInputError``, which names the part."""
    n = len(form.left)
    _require_counts(form)
    _require_possible_markers(form.measuring)
    require_plausible_time("captured_at", form.captured_at, now, tolerance)
    times = _times(form, now, tolerance)
    index = [None] if n == 1 else range(n)
    left = [read_image("left", upload, k) for k, upload in zip(index, form.left, strict=True)]
    right = [read_image("right", upload, k) for k, upload in zip(index, form.right, strict=True)]
    _require_distinct(left, right)
    first, *further = (
        NewPair(one, other, *exposed) for one, other, exposed in zip(left, right, times, strict=True)
    )
    return NewStage(
        form.name,
        first.left,
        first.right,
        form.captured_at,
        first.left_exposed_at,
        first.right_exposed_at,
        further,
        form.measuring,
    )


def require_calibrated_sizes(new: NewStage, calibration: Calibration) -> None:
    """Raise ``InvalidInputError`` unless each image has the size that its camera is calibrated for."""
    pairs = [(new.left, new.right), *((pair.left, pair.right) for pair in new.further)]
    for index, pair in enumerate(pairs):
        for side, image in zip(_SIDES, pair, strict=True):
            width, height = calibration.rig[side]["image_size_px"]
            if image.header.size != (width, height):
                error = ImageSizeError(
                    f"the image is {image.header.width} x {image.header.height} px, but its camera is calibrated for"
                    f" {width} x {height} px; send the calibration of the cameras that took the images"
                )
                raise InvalidInputError(side, error, index if new.further else None)


def _require_counts(form: StageForm) -> None:
    """Raise ``InvalidInputError`` unless there is one of everything for each pair, and not too many pairs."""
    n = len(form.left)
    if max(n, len(form.right)) > MAX_PAIRS:
        error = BurstTooLongError(f"a burst has at most {MAX_PAIRS} pairs; send fewer")
        raise InvalidInputError("left" if n > MAX_PAIRS else "right", error)
    if len(form.right) != n:
        detail = f"{n} left and {len(form.right)} right images; send both of every pair"
        raise InvalidInputError("right", BurstUnequalError(detail))
    counts = {"left_exposed_at": len(form.left_exposed_at), "right_exposed_at": len(form.right_exposed_at)}
    for name, count in counts.items():
        if any(counts.values()) and count != n:
            detail = f"{count} times for {n} pairs; send both times of every pair, or none"
            raise InvalidInputError(name, BurstUnequalError(detail))


def _require_possible_markers(measuring: Measuring) -> None:
    """Raise ``InvalidInputError`` for a marker whose balls overlap, or that cannot be told from another one."""
    for index in range(len(measuring.markers)):
        try:
            require_possible(measuring.models[: index + 1])
        except ParameterError as error:
            raise InvalidInputError("marker", error, index) from error


def _times(
    form: StageForm, now: datetime, tolerance: timedelta
) -> Sequence[tuple[datetime | None, datetime | None]]:
    """Return the times of exposure of each pair, left and right, after checking that they follow each other."""
    if not form.left_exposed_at:
        return [(None, None)] * len(form.left)
    for name, times in (
        ("left_exposed_at", form.left_exposed_at),
        ("right_exposed_at", form.right_exposed_at),
    ):
        for time in times:
            require_plausible_time(name, time, now, tolerance)
        for k in range(1, len(times)):
            if times[k] <= times[k - 1]:
                error = TimeImplausibleError(
                    f"pair {k + 1} was not exposed after pair {k}; send the pairs and their times in order"
                )
                raise InvalidInputError(name, error, k)
    return list(zip(form.left_exposed_at, form.right_exposed_at, strict=True))


def _require_distinct(left: Sequence[NewImage], right: Sequence[NewImage]) -> None:
    """Raise ``InvalidInputError`` if one image was sent twice."""
    if len(left) == 1 and left[0].content == right[0].content:
        raise InvalidInputError(
            "right", SameImageError("left and right are the same image; send the left and the right one")
        )
    first: dict[str, str] = {}
    for index, pair in enumerate(zip(left, right, strict=True)):
        for side, image in zip(_SIDES, pair, strict=True):
            place = f"{side} {index + 1}"
            if image.sha256 in first:
                detail = (
                    f"{place} is the same image as {first[image.sha256]}; send each image of the burst once"
                )
                raise InvalidInputError(side, SameImageError(detail), index)
            first[image.sha256] = place
