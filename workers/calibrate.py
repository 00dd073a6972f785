"""From the pictures of a control field to a calibration document."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

from spinewatch.calibration.files import ShotFiles, calibrate_files, control_field, solve_parameters
from spinewatch.calibration.from_images import FromImagesParameters
from spinewatch.progress import Progress
from store.calibration_requests import CalibrationWork

_VERSION = version("spinewatch")


def calibrate(work: CalibrationWork, progress: Progress) -> dict[str, Any]:
    """Return the calibration document of a request, with ``version``; shots are named "1", "2" and so on.

    Raises a ``SpinewatchError`` for pictures that no calibration can be made from.
    """
    pixel_size = work.options["pixel_size_mm"]
    parameters = FromImagesParameters(
        pixel_size_mm=None if pixel_size is None else (pixel_size[0], pixel_size[1]),
        solve=solve_parameters(work.options["free"], work.options["fixed"], work.options["estimate_aspect"]),
    )
    document = calibrate_files(
        [ShotFiles(str(number), *pair) for number, pair in enumerate(work.pairs, start=1)],
        control_field(work.control_field, work.control_points),
        parameters,
        progress,
        verify=work.verify,
        rig_name=work.name,
    )
    return {**document, "version": _VERSION}
