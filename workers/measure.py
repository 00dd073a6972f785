"""From the files of a stage to its result document."""

from __future__ import annotations

from datetime import timedelta
from importlib.metadata import version
from typing import Any, Literal, cast

from contract.stage_documents import flags_document, stage_document
from spinewatch.flags import Flag
from spinewatch.imaging.decoding import decode_image
from spinewatch.pipeline import Parameters, StageRequest, measure_stage, parameters_document
from spinewatch.progress import Progress
from spinewatch.rig_files.rig_json import rig_from_dict
from store.stages import StageWork

_VERSION = version("spinewatch")
_DAY = timedelta(days=1)


def measure(work: StageWork, progress: Progress, max_calibration_age: timedelta) -> dict[str, Any]:
    """Return the stage document (docs/api.md) of a stage, with ``parameters`` and ``version``.

    A calibration that was older than ``max_calibration_age`` is flagged. Raises a ``SpinewatchError`` for
    pictures that cannot be measured.
    """
    progress("decode", 0.0)
    left, right = decode_image(work.left), decode_image(work.right)
    axis = cast(Literal["x", "y", "auto"], work.spine_axis)
    request = StageRequest(labels=work.vertebrae, spine_axis=axis)
    parameters = Parameters()
    measured = measure_stage(left, right, rig_from_dict(work.rig), request, parameters, progress)
    document = stage_document(measured)
    max_days = max_calibration_age / _DAY
    return {
        **document,
        "flags": [*document["flags"], *flags_document(_age_flags(work.calibration_age / _DAY, max_days))],
        "parameters": {**parameters_document(parameters), "calibration_max_age_days": max_days},
        "version": _VERSION,
    }


def _age_flags(days: float, max_days: float) -> list[Flag]:
    if days <= max_days:
        return []
    sentence = (
        f"the calibration was {days:.1f} days old when the stage was taken, and at most {max_days:g} are allowed;"
        " calibrate before the operation"
    )
    return [Flag("calibration-old", sentence)]
