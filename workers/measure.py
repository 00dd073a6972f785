"""From the files of a stage to its result document; the only place that decodes an upload."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any, Literal, cast

from spinewatch.formats.images import decode_image
from spinewatch.formats.rig_json import rig_from_dict
from spinewatch.formats.stage_json import stage_document
from spinewatch.pipeline import Parameters, Progress, StageRequest, measure_stage, parameters_document
from store.stages import Work

_VERSION = version("spinewatch")


def measure(work: Work, progress: Progress) -> dict[str, Any]:
    """Return the stage document (docs/api.md) of a stage, with ``parameters`` and ``version``.

    Raises a ``SpinewatchError`` for pictures that cannot be measured.
    """
    progress("decode", 0.0)
    left, right = decode_image(work.left), decode_image(work.right)
    axis = cast(Literal["x", "y", "auto"], work.spine_axis)
    request = StageRequest(labels=work.vertebrae, spine_axis=axis)
    parameters = Parameters()
    measured = measure_stage(left, right, rig_from_dict(work.rig), request, parameters, progress)
    return {
        **stage_document(measured),
        "parameters": parameters_document(parameters),
        "version": _VERSION,
    }
