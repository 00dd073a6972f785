"""Whether two images belong together: how many of their features meet, compared with displaced epipolar lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.errors import ParameterError
from spinewatch.matching.epipolar import EpipolarParameters, epipolar_distance_mrad
from spinewatch.triads.diagnosis_parameters import DiagnosisParameters


def meeting_sigma(
    pair: tuple[Features, Features], rig: Rig, epipolar: EpipolarParameters, parameters: DiagnosisParameters
) -> float:
    """Return by how many standard deviations more features meet than if the epipolar lines are displaced.

    Parameters
    ----------
    pair
        Features of the two images, of whatever they show.
    rig
        The calibrated cameras.
    epipolar
        Range of the markers and extension of the epipolar segments, those of the search; without a range in mm, the
        fractions of `parameters` define it.
    parameters
        How features are counted.

    Returns
    -------
    float
        Standard deviations; 0 if the range is not given and the optical axes do not meet in front of the cameras.

    References
    ----------
    Not in the thesis.
    """
    p, values = parameters, []
    limits = replace(epipolar, range_fractions=p.range_fractions)
    first, last, step = p.meeting_offsets_mrad
    beside = np.arange(first, last, step)
    offsets = np.concatenate([[0.0], beside, -beside])
    for count in p.meeting_features:
        left, right = (f.best(count).rays(c) for c, f in zip((rig.left, rig.right), pair, strict=True))
        try:
            distance, inside = epipolar_distance_mrad(left, right, rig, limits)
        except ParameterError:
            return 0.0
        i, j = np.nonzero(inside & (np.abs(distance) < last + p.meeting_mrad))
        near = np.abs(distance[i, j] - offsets[:, None]) < p.meeting_mrad
        met = np.array([min(len(np.unique(i[k])), len(np.unique(j[k]))) for k in near])
        values.append((met[0] - met[1:].mean()) / max(met[1:].std(), 1.0))
    return float(np.mean(values))
