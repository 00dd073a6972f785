"""What `process` needs of a method of measurement, and the default one."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Protocol, TypeVar

import cv2

from commands.shared.files import read_bytes, write_bytes
from commands.shared.pixels import gray_levels
from spinewatch.camera import Rig
from spinewatch.detection.candidates.templates import TemplateError, read_template_set
from spinewatch.errors import ParameterError
from spinewatch.imaging.frame import Frame
from spinewatch.parameters import Parameters
from spinewatch.pipeline import StageMeasurer
from spinewatch.progress import Progress
from spinewatch.stage import StageMeasurement, StageRequest

Templates = TypeVar("Templates")
SizeReduction = Literal["sd", "mean", "none"]


@dataclass(frozen=True)
class MethodOptions:
    """Options of a method; None is its own choice.

    The range of the markers, mm; whether candidates are refined; a file of templates; the statistic of rows by which
    the method of 1995 finds the surgical field.
    """

    range_mm: tuple[float, float] | None = None
    refine: bool | None = None
    templates: Path | None = None
    size_reduction: SizeReduction | None = None


class Measurer(Protocol):
    """Measures the pairs of one rig."""

    def measure(
        self, left: Frame, right: Frame, request: StageRequest, progress: Progress, *, explained: bool
    ) -> StageMeasurement:
        """Return the labelled triads of a pair."""


@dataclass(frozen=True)
class Method:
    """A method that is prepared for a rig, and how it writes what a pair becomes on the way to its features."""

    measurer: Measurer
    write_steps: Callable[[Path, tuple[Frame, Frame], StageRequest], None]


Prepare = Callable[[Rig, MethodOptions, Executor], Method]


def prepare_default(rig: Rig, options: MethodOptions, pool: Executor) -> Method:
    """Return the default method for a rig."""
    if options.size_reduction is not None:
        raise ParameterError(
            "--size-reduction is a step of the method of 1995; give --method thesis-1995 with it"
        )
    templates = read_templates(options.templates, read_template_set)
    measurer = StageMeasurer(rig, default_parameters(options), templates, pool)

    def write_steps(folder: Path, frames: tuple[Frame, Frame], _: StageRequest) -> None:
        for frame, maps in zip(frames, measurer.maps(*frames), strict=True):
            if maps is None:
                continue
            for name in ("tone", "activity", "feature_space"):
                png = bytes(cv2.imencode(".png", gray_levels(getattr(maps, name)))[1])
                write_bytes(folder / f"{frame.side}-{name.replace('_', '-')}.png", png)

    return Method(measurer, write_steps)


def default_parameters(options: MethodOptions) -> Parameters:
    """Return the parameters of the default method."""
    parameters = Parameters()
    matching = parameters.search.matching
    if options.range_mm is not None:
        matching = replace(matching, epipolar=replace(matching.epipolar, range_mm=options.range_mm))
    if options.refine is not None:
        matching = replace(matching, refinement=replace(matching.refinement, enabled=options.refine))
    return replace(parameters, search=replace(parameters.search, matching=matching))


def read_templates(path: Path | None, read: Callable[[bytes], Templates]) -> Templates | None:
    """Return the templates of a file, or None without one; the error of a wrong file names it."""
    if path is None:
        return None
    try:
        return read(read_bytes(path))
    except TemplateError as error:
        raise TemplateError(f"{path}: {error}") from error
