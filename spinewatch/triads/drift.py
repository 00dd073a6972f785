"""Search for triads with a check of the rig: a drift of the cameras is flagged, and corrected on request."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.flags import Flag
from spinewatch.markers import FLAT_10_14_18, TriadModel
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
