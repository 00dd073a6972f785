"""The search for triads, and what their balls say about the rig that it was made with."""

from __future__ import annotations

from collections.abc import Callable

from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.flags import Flag
from spinewatch.matching.rig_check import RigCheck, RigCheckParameters, check_rig, refined_rig
from spinewatch.triads.search import TriadSearch, ball_images

_REFINED = "the relative orientation of the cameras was corrected by the balls; calibrate again when possible"


def check_search(
    search: Callable[[Rig], TriadSearch],
    left: Features,
    right: Features,
    rig: Rig,
    parameters: RigCheckParameters,
) -> tuple[TriadSearch, RigCheck | None, tuple[Flag, ...]]:
    """Return what ``search`` finds in these features with a rig, the check of the rig, and its flags.

    A rig that has drifted is flagged; with ``refine`` the search is repeated with the refined one. The check
    is None when the balls are too few.
    """
    found = search(rig)
    check = check_rig(rig, *ball_images(found, left, right), parameters)
    if check is None or not check.drifted:
        return found, check, ()
    drift = Flag("calibration-drift", check.sentence)
    if not parameters.refine:
        return found, check, (drift,)
    return search(refined_rig(rig, check)), check, (drift, Flag("rig-refined", _REFINED))
