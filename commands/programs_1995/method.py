"""The published method for `process`: prepared for a rig, with the files of its programs."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

from commands.programs_1995.explanation import draw_matching, write_detection, write_matching
from commands.programs_1995.inputs import STATISTICS
from commands.shared.methods import Method, MethodOptions, read_templates
from spinewatch.camera import Rig
from spinewatch.imaging.frame import Frame
from spinewatch.pipeline_1995 import PublishedMeasurer, PublishedParameters
from spinewatch.stage import StageRequest
from spinewatch.thesis_1995.template_trees import read_trees


def prepare_published(rig: Rig, options: MethodOptions, pool: Executor) -> Method:
    """Return the method of 1995 for a rig."""
    parameters = PublishedParameters()
    sets, detection = parameters.sets, parameters.detection
    if options.range_mm is not None:
        sets = replace(sets, epipolar=replace(sets.epipolar, range_mm=options.range_mm))
    if options.refine is not None:
        sets = replace(sets, refine=options.refine)
    if options.size_reduction is not None:
        preprocessing = replace(detection.preprocessing, statistic=STATISTICS[options.size_reduction])
        detection = replace(detection, preprocessing=preprocessing)
    measurer = PublishedMeasurer(
        rig,
        replace(parameters, sets=sets, detection=detection),
        read_templates(options.templates, read_trees),
        pool,
    )

    def write_steps(folder: Path, frames: tuple[Frame, Frame], request: StageRequest) -> None:
        steps = measurer.steps(*frames, request)
        features = steps.left.features, steps.right.features
        for frame, found in zip(frames, (steps.left, steps.right), strict=True):
            write_detection(found, folder, f"{frame.side}-")
        write_matching(steps.matching, *features, rig, folder)
        draw_matching(steps.matching, features, frames, folder)

    return Method(measurer, write_steps)
