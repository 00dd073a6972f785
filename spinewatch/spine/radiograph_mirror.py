"""Whether the common points of radiographs would show that a view is mirrored; NumPy only."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.spine.radiograph_fit import (
    CommonPointsError,
    RadiographFitParameters,
    SimilarityFit,
    chi2_p_value,
)

_MIRRORED = {"PA": np.array([1.0, -1.0, 1.0]), "lateral": np.array([-1.0, 1.0, 1.0])}
"""What mirroring a view does to points in the axes of the radiographs."""


def mirror_flags(
    fit_of: Callable[[Float], SimilarityFit],
    source_mm: Float,
    is_contradicted: Callable[[SimilarityFit], bool],
    parameters: RadiographFitParameters,
) -> Iterator[Flag]:
    """Yield a flag when common points fit a mirrored view: alone, or so that nothing would show one.

    Parameters
    ----------
    fit_of
        Returns the fit of common points in the axes of the radiographs, shape (n, 3), mm, to object space.
    source_mm
        The common points in these axes, shape (n, 3), mm.
    is_contradicted
        Returns whether something else contradicts a fit: the patient axes that the setup states.
    parameters
        Probability of the test, and the scale that is refused.

    Yields
    ------
    Flag
        ``radiograph-mirror-possible``, once, with the views.

    Examples
    --------
    >>> from spinewatch.spine.radiograph_fit import fit_common_points
    >>> points = 100 * np.array([[0.0, 0, 0], [0, 1, 0], [0, 0, 2], [1, 1, 1]])
    >>> def fit(source):
    ...     n = len(source)
    ...     return fit_common_points([str(k) for k in range(n)], source, np.ones(3), points[:n], [np.eye(3)] * n)
    >>> p = RadiographFitParameters()
    >>> [len(list(mirror_flags(fit, points[:n], lambda fit: False, p))) for n in (3, 4)]
    [1, 0]
    """
    found = []
    for view, signs in _MIRRORED.items():
        try:
            fit = fit_of(source_mm * signs)
        except CommonPointsError:
            continue
        likely = chi2_p_value(fit.chi2, fit.dof) >= parameters.significance
        if likely and abs(fit.transform.scale - 1) <= parameters.refused_scale and not is_contradicted(fit):
            found.append(view)
    if not found:
        return
    given = fit_of(source_mm)
    fits = chi2_p_value(given.chi2, given.dof) >= parameters.significance
    views, points = " or ".join(found), f"the {len(source_mm)} common points"
    yield Flag(
        "radiograph-mirror-possible",
        f"{points} fit a mirrored {views} view as well as the one that was given, which would exchange the sides of the"
        " spine; give a further point out of their plane, and check the side that each image shows"
        if fits
        else f"{points} fit a mirrored {views} view, and not the one that was given; check the side that each image"
        " shows, and whether it was mirrored",
    )
