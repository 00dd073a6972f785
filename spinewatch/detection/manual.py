"""Ball centres that a person adds, moves or removes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.detection.features import Features
from spinewatch.detection.placed_centres import like_balls, not_used, placed_covariances
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.duplicates import same_ball

_SCORE = 1.0
"""Score of a centre that a person placed: it is a ball."""


@dataclass(frozen=True)
class CentreEdit:
    """What a person did to a feature.

    Attributes
    ----------
    feature
        Index of the feature; None for a centre that is added.
    xy_px
        Its centre (u, v), px; None when the feature is no ball.
    """

    feature: int | None
    xy_px: tuple[float, float] | None


def edit_features(
    features: Features,
    edits: Sequence[CentreEdit],
    ball_px: tuple[float, float],
    parameters: CentreParameters,
    detected: Features | None = None,
) -> Features:
    """Return the features of an image after the edits of a person.

    A centre that a person placed is a ball beyond doubt; it takes the place of features of the same ball. Its deviation
    is that of a person's hand where something like a ball was detected, and wider elsewhere.

    Parameters
    ----------
    features
        n features.
    edits
        Centres that are added, moved or removed.
    ball_px
        Nominal width and height of a ball, px.
    parameters
        Deviation of a person's centres, and the distance within which features are the same ball.
    detected
        Features that were detected before all edits; None for ``features``.

    Returns
    -------
    Features
        Features, best score first; ``manual`` tells which a person placed.

    Examples
    --------
    >>> centres = np.array([[10.0, 20.0], [30.0, 40.0], [50.0, 60.0]])
    >>> found = Features.with_sigma(centres, np.array([0.9, 0.7, 0.6]), 0.1)
    >>> edits = [CentreEdit(1, (31.0, 40.0)), CentreEdit(0, None), CentreEdit(None, (70.0, 80.0))]
    >>> after = edit_features(found, edits, (10.0, 10.0), CentreParameters())
    >>> after.xy_px.tolist(), after.manual.tolist()
    ([[31.0, 40.0], [70.0, 80.0], [50.0, 60.0]], [True, True, False])
    """
    if not edits:
        return features
    radius = np.array(ball_px) / 2
    placed = np.array([edit.xy_px for edit in edits if edit.xy_px is not None]).reshape(-1, 2)
    kept = np.ones(len(features), dtype=bool)
    kept[[edit.feature for edit in edits if edit.feature is not None]] = False
    kept &= ~np.any(same_ball(features.xy_px, placed, radius, parameters.merge_radius), axis=1)
    rest = features.take(np.flatnonzero(kept))
    before = like_balls(features if detected is None else detected, parameters)
    gone = not_used(before, rest.xy_px, radius, parameters.merge_radius)
    visible = np.ones(len(rest)) if rest.visible is None else rest.visible
    all_features = Features(
        np.concatenate([placed, rest.xy_px]),
        np.concatenate([np.full(len(placed), _SCORE), rest.score]),
        np.concatenate([placed_covariances(placed, gone, radius, parameters), rest.covariance_px2]),
        np.concatenate([np.ones(len(placed)), visible]),
        np.concatenate([np.ones(len(placed), dtype=bool), rest.is_manual]),
    )
    return all_features.take(np.argsort(-all_features.score, kind="stable"))
