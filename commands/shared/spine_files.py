"""The spine of a surgery from files: a setup, and the results of ``spinewatch process`` in the order of the stages."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from commands.shared.files import InputError, printable_name, read_image, read_json, read_text
from commands.shared.repeated_stages import ShownStage, repetition_flags
from commands.shared.validation import first_problem
from contract.base import StageName
from contract.flag import Flag
from contract.image import Image, ImagePair
from contract.job import JobState
from contract.library_setup import SurgeryLevels
from contract.radiograph import Radiograph
from contract.setup_checks import SurgeryContext, check_rebaseline, check_setup
from contract.spine import StageSpine
from contract.spine_setup import SpineSetup, StoredRebaseline, StoredSpineSetup
from contract.stage_reference import StageReference
from contract.summary import SummaryStage, SurgerySummary
from contract.triad import Triad
from exports.text import single_line
from spinewatch.errors import ImageError, ParameterError, SameImageError, SpinewatchError
from spinewatch.imaging.header import inspect_image
from spinewatch.levels import anatomical_sequence, canonical_name
from spinewatch.spine.radiograph_landmarks import RadiographView
from spinewatch.spine.stage_order import comparisons
from spinewatch.triads.pose import Pose
from workers.spine_documents import SpineInputs, spine_document

SURGERY = "files"
"""Identifier of the surgery and of its calibration in documents made from files."""

_EXAMPLE = "PRE=pre.json, or PRE=pre.json,left.png,right.png"
_TRIADS = TypeAdapter(list[Triad])
_FLAGS = TypeAdapter(list[Flag])
_TEXT = TypeAdapter(str)
_NAME: TypeAdapter[str] = TypeAdapter(StageName)


@dataclass(frozen=True)
class StageFile:
    """A stage named on the command line: its result, and its images if they are given."""

    name: str
    result: Path
    images: tuple[Path, Path] | None


@dataclass(frozen=True)
class StageContent:
    """What the files of a stage hold; fields of the images are empty without them."""

    file: StageFile
    images: ImagePair
    triads: list[Triad]
    flags: list[Flag]
    version: str

    def poses(self) -> dict[str, Pose]:
        """Return the poses of the labelled triads."""
        found = ((triad.label, triad.pose()) for triad in self.triads)
        return {label: pose for label, pose in found if label is not None and pose is not None}


def parse_stages(arguments: Sequence[str]) -> list[StageFile]:
    """Return the stages of ``STAGE=result.json[,left.png,right.png]``; raises ``ParameterError``."""
    found = []
    for argument in arguments:
        name, equals, rest = argument.partition("=")
        parts = [part for part in rest.split(",") if part]
        if not name or not equals or len(parts) not in {1, 3}:
            raise ParameterError(f"{argument!r} names no stage; write it like {_EXAMPLE}")
        _require_name(name)
        images = (Path(parts[1]), Path(parts[2])) if len(parts) > 1 else None
        found.append(StageFile(name, Path(parts[0]), images))
    names = [stage.name for stage in found]
    if len(set(names)) < len(names):
        raise ParameterError("a stage is named twice; give each stage its own name")
    return found


def read_stages(stages: Sequence[StageFile]) -> list[StageContent]:
    """Return the content of the files of stages, those flagged that show an earlier one again.

    Raises ``InputError`` for a file that is no result of a pair, and ``ImageError`` for what is no image.
    """
    contents: list[StageContent] = []
    shown: list[ShownStage] = []
    for stage in stages:
        content = _read_stage(stage)
        shown.append(ShownStage(stage.name, content.images, content.triads))
        known = {flag.code for flag in content.flags}
        flags = [flag for flag in repetition_flags(shown[-1], shown[:-1]) if flag.code not in known]
        contents.append(replace(content, flags=[*content.flags, *flags]))
    return contents


def read_setup(path: Path) -> tuple[SpineSetup, list[StoredRebaseline]]:
    """Return a setup, or a stored one with its re-clamped markers; raises ``InputError``."""
    document = read_json(path)
    stored = isinstance(document, dict) and "setup" in document
    text = read_text(path)
    try:
        if stored:
            whole = StoredSpineSetup.model_validate_json(text)
            return whole.setup, whole.rebaselines
        return SpineSetup.model_validate_json(text), []
    except ValidationError as error:
        raise InputError(f"{path} is no setup of a spine: {first_problem(error)}") from error


def read_radiographs(paths: Sequence[Path]) -> list[Radiograph]:
    """Return radiographs as ``GET .../radiographs/{id}`` shows them; raises ``InputError``."""
    found = []
    for path in paths:
        try:
            found.append(Radiograph.model_validate_json(read_text(path)))
        except ValidationError as error:
            raise InputError(f"{path} is no description of a radiograph: {first_problem(error)}") from error
    return found


def summarize(
    setup_path: Path,
    stages: Sequence[StageFile],
    reference: str | None,
    extra_levels: Sequence[str] = (),
    radiographs: Sequence[Radiograph] = (),
) -> SurgerySummary:
    """Return the spine at every stage, as the service would; without images, their hashes are empty.

    Raises ``SpinewatchError`` for files that cannot be used.
    """
    setup, rebaselines = read_setup(setup_path)
    if reference is not None:
        setup = setup.model_copy(update={"reference_vertebra": canonical_name(reference)})
    contents = read_stages(stages)
    levels = _levels(setup, contents, extra_levels)
    context = SurgeryContext(
        vertebrae=levels[0],
        reference_vertebra=levels[1],
        extra_levels=extra_levels,
        stages=[stage.name for stage in stages],
        radiographs={radiograph.id: radiograph.view for radiograph in radiographs},
    )
    check_setup(setup, context)
    for rebaseline in rebaselines:
        check_rebaseline(rebaseline, setup, context)
    now = datetime.now(UTC)
    inputs = SpineInputs(
        surgery_id=SURGERY,
        setup=setup,
        revision=1,
        rebaselines=rebaselines,
        levels=SurgeryLevels(levels[1], extra_levels),
        stages={content.file.name: content.poses() for content in contents},
        references={
            stage.name: StageReference(name=stage.name, take=1, calibration_id=SURGERY) for stage in stages
        },
        radiographs={
            item.id: RadiographView((item.pixel_spacing_mm[0], item.pixel_spacing_mm[1]), item.positive_on)
            for item in radiographs
        },
    )
    return SurgerySummary(
        surgery_id=SURGERY,
        reference=single_line(printable_name(setup_path.stem)),
        vertebrae=list(levels[0]),
        reference_vertebra=levels[1],
        created_at=now,
        setup=StoredSpineSetup(
            surgery_id=SURGERY, revision=1, created_at=now, setup=setup, rebaselines=rebaselines
        ),
        stages=_summary_stages(inputs, contents, levels[1], now),
        version=version("spinewatch"),
    )


def _summary_stages(
    inputs: SpineInputs, contents: Sequence[StageContent], reference: str, now: datetime
) -> list[SummaryStage]:
    triad = inputs.setup.reference_vertebra or reference
    names = [(content.file.name, triad in inputs.stages[content.file.name]) for content in contents]
    found = []
    compared = comparisons(names[0][0], names, inputs.setup.baseline) if names else ()
    for content, others in zip(contents, compared, strict=True):
        name = content.file.name
        spine: StageSpine | None = None
        reason: str | None = None
        try:
            spine = spine_document(inputs, name, others.baseline, others.previous)
        except SpinewatchError as error:
            reason = str(error)
        found.append(
            SummaryStage(
                name=name,
                take=1,
                calibration_id=SURGERY,
                state=JobState.SUCCEEDED,
                captured_at=None,
                created_at=now,
                images=content.images,
                triads=content.triads,
                flags=content.flags,
                version=content.version,
                spine=spine,
                spine_reason=reason,
            )
        )
    return found


def _require_name(name: str) -> None:
    """Raise ``ParameterError`` for a name that the service gives to no stage."""
    try:
        _NAME.validate_python(name)
    except ValidationError as error:
        raise ParameterError(
            f"{name!r} cannot be the name of a stage; use up to 64 letters, digits, dots, dashes and underscores, a"
            " letter or digit first"
        ) from error


def _levels(
    setup: SpineSetup, contents: Sequence[StageContent], extra_levels: Sequence[str]
) -> tuple[list[str], str]:
    """Return the vertebrae with a marker, cranial first, and the reference."""
    labels = {label for content in contents for label in content.poses()} | set(setup.levels or ())
    sequence = anatomical_sequence(extra_levels)
    found = setup.reference_vertebra
    if found is None:
        raise ParameterError(
            "the setup names no reference_vertebra; name it there, or with --reference, for example L1"
        )
    return [level for level in sequence if level in labels | {found}], found


def _read_stage(stage: StageFile) -> StageContent:
    document = read_json(stage.result)
    try:
        return StageContent(
            file=stage,
            images=_images(stage.images),
            triads=_TRIADS.validate_json(json.dumps(document["triads"])),
            flags=_FLAGS.validate_json(json.dumps(document["flags"])),
            version=_TEXT.validate_json(json.dumps(document["version"])),
        )
    except (KeyError, TypeError, RecursionError) as error:
        raise InputError(
            f"{stage.result} is no result of a stage; give the JSON of `spinewatch process`"
        ) from error
    except ValidationError as error:
        raise InputError(f"{stage.result} is no result of a stage: {first_problem(error)}") from error


def _images(paths: tuple[Path, Path] | None) -> ImagePair:
    left, right = (None, None) if paths is None else paths
    pair = ImagePair(left=_image(left), right=_image(right))
    if paths is not None and pair.left.sha256 == pair.right.sha256:
        raise SameImageError(f"{left} and {right} are the same image; give the left and the right one")
    return pair


def _image(path: Path | None) -> Image:
    """Return the model of an image file; all fields are empty without one."""
    if path is None:
        return Image(sha256="", media_type="", width_px=0, height_px=0, size_bytes=0)
    content = read_image(path)
    try:
        header = inspect_image(content)
    except ImageError as error:
        raise ImageError(f"{path}: {error}") from error
    return Image(
        sha256=hashlib.sha256(content).hexdigest(),
        media_type=header.media_type,
        width_px=header.size[0],
        height_px=header.size[1],
        size_bytes=len(content),
    )
