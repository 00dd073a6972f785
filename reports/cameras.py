"""The report of a calibration of any number of cameras."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.camera_table import camera_table
from reports.rendering import render


def cameras_report(document: Mapping[str, Any]) -> str:
    """Return the report of a calibration of cameras.

    Parameters
    ----------
    document
        The document that ``spinewatch calibrate`` prints for one CSV file of image points per camera.

    Returns
    -------
    str
        One HTML page that refers to no other file.
    """
    cameras = {camera["name"]: camera for camera in document["cameras"]}
    return render("cameras.html", document=document, cameras=camera_table(cameras, document["quality"]))
