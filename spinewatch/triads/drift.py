"""Search for triads with a check of the rig: a drift of the cameras is flagged, and corrected on request."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.flags import Flag
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.matching.marker_scale import MarkerScale, MarkerScaleParameters, pooled_scale
from spinewatch.matching.rig_check import RigCheck, RigCheckParameters, check_rig, refined_rig
from spinewatch.triads.search import TriadSearch, ball_images, marker_balls

_REFINED = "the relative orientation of the cameras was corrected from the ball images; calibrate again when possible"


def search_and_check_rig(
    search: Callable[[Rig], TriadSearch],
    left: Features,
    right: Features,
    rig: Rig,
    parameters: RigCheckParameters,
    models: Sequence[TriadModel] = (FLAT_10_14_18,),
) -> tuple[TriadSearch, RigCheck | None, tuple[Flag, ...]]:
    """Return the triads found with a rig, the check of the rig from their balls, and its flags.

    Parameters
    ----------
    search
        Search for triads in the features with a given rig.
    left, right
        Features of the two images.
    rig
        The calibrated cameras.
    parameters
        Limits of the check. With ``refine`` the search is repeated with the corrected rig if the rig has drifted across
        the epipolar lines.
    models
        Markers in use, as in the search.

    Returns
    -------
    search : TriadSearch
        Result of the search, or of the repeated one.
    check : RigCheck or None
        Check of the given rig; None if there are too few balls.
    flags : tuple of Flag
        "calibration-drift" if the rig has drifted, "rig-refined" if it was corrected.
    """
    found = search(rig)
    check = check_rig(rig, *ball_images(found, left, right), parameters, marker_balls(found, models))
    if check is None or not check.drifted:
        return found, check, ()
    drift = Flag("calibration-drift", check.message)
    if not parameters.refine or not check.off_epipolar:
        return found, check, (drift,)
    return search(refined_rig(rig, check)), check, (drift, Flag("rig-refined", _REFINED))


def series_flags(
    scales: Sequence[MarkerScale], parameters: MarkerScaleParameters | None = None
) -> Iterator[Flag]:
    """Yield a flag when stages of one calibration show together that markers are not measured in their size.

    Parameters
    ----------
    scales
        Scale of the markers in each stage.
    parameters
        Limit of the p-value; the default one if None.

    Yields
    ------
    Flag
        ``calibration-drift``; never for a single stage, which `search_and_check_rig` judges.

    Examples
    --------
    >>> one = MarkerScale(12, 1.0044, 0.0011, 0.001, 0.0056, False, 0.1, -1.8)
    >>> [flag.code for flag in series_flags([one] * 3)], list(series_flags([one]))
    (['calibration-drift'], [])
    """
    pooled = pooled_scale(scales, parameters) if len(scales) > 1 else None
    if pooled is not None and pooled.drifted:
        detail = (
            f"in the {len(scales)} stages of this calibration together, {pooled.message}; calibrate again"
        )
        yield Flag("calibration-drift", detail)
