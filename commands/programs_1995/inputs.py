"""Files that the programs of 1995 read: cameras and feature lists."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from commands.shared.files import InputError, read_text
from contract.features import FeaturePair
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.errors import SpinewatchError
from spinewatch.rig_files.formats import parse_rig_files
from spinewatch.thesis_1995.data_files import FeatureList, parse_features
from spinewatch.thesis_1995.preprocessing import SegmentStatistic

SIGMA_PX = 0.67
"""Standard deviation of a feature without one of its own, px: that of Table 4.4."""

STATISTICS = {"sd": SegmentStatistic.STANDARD_DEVIATION, "mean": SegmentStatistic.MEAN, "none": None}
"""Statistic of the rows by which the surgical field is found, by its name in --size-reduction."""


def read_cameras(path: Path) -> Rig:
    """Return the rig of a rig JSON or of a ``CameraParameters.dat``."""
    text = read_text(path)
    rig_format: Literal["json", "1995"] = "json" if text.lstrip("\ufeff \r\n\t").startswith("{") else "1995"
    try:
        return parse_rig_files(
            {"": text}, rig_format, name=path.stem, image_size_px=None, pixel_size_mm=(0.01, 0.00845)
        ).rig
    except SpinewatchError as error:
        raise InputError(f"{path}: {error}") from error


def read_feature_list(path: Path) -> Features:
    """Return the features of a ``FEATURES.DAT`` or ``PixelsLEFT.dat``."""
    try:
        listed = parse_features(read_text(path))
    except SpinewatchError as error:
        raise InputError(f"{path}: {error}") from error
    return Features.with_sigma(listed.xy_px, listed.score, SIGMA_PX)


def read_feature_pair(path: Path) -> tuple[Features, Features]:
    """Return the left and right features of a ``features.json``, as ``simulate`` writes it."""
    try:
        pair = FeaturePair.model_validate_json(read_text(path))
    except ValueError as error:
        raise InputError(f"{path} is not a features.json; write one with `spinewatch simulate`") from error
    left, right = (
        Features.with_sigma(
            np.array([[f.x, f.y] for f in side], dtype=np.float64).reshape(-1, 2),
            np.array([f.score for f in side], dtype=np.float64),
            SIGMA_PX,
        )
        for side in (pair.left, pair.right)
    )
    return left, right


def feature_list(features: Features) -> FeatureList:
    """Return features as a list that can be written."""
    return FeatureList(features.xy_px, features.score)
