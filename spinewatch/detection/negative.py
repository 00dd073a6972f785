"""Whether an image is a negative: balls are found when its gray levels are reversed, and none as it is."""

from __future__ import annotations

from dataclasses import replace

from spinewatch.detection.candidates.search import CandidateSearch, Detection
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.centres import refine
from spinewatch.detection.refinement.networks import BallNetworks
from spinewatch.detection.refinement.proposals import NominalView, propose
from spinewatch.imaging.exposure import Exposure
from spinewatch.imaging.frame import Frame


def is_negative(
    frame: Frame,
    found: Detection,
    view: NominalView,
    search: CandidateSearch,
    networks: BallNetworks,
    centres: CentreParameters,
) -> bool:
    """Return whether the negative of an image has balls and the image has none.

    Parameters
    ----------
    frame
        The image.
    found
        Its detection, with refined centres.
    view
        What the rig determines of the balls in the view.
    search
        Candidate search of the view; its parameters of quality have the least numbers of balls.
    networks
        Networks that estimate the centres.
    centres
        Parameters of the centres.

    Returns
    -------
    bool
        Whether it is a negative; images with balls enough and blank ones are not examined.
    """
    p = search.parameters.quality
    balls = int((found.features.score > p.min_ball_score).sum())
    if balls >= p.min_balls or found.exposure is Exposure.BLANK:
        return False
    negative = replace(frame, pixels=frame.pixels.max() - frame.pixels)
    candidates = search.detect(negative).features
    proposals = propose(view, negative, candidates, networks, centres)
    refined, _ = refine((proposals, proposals), centres, any_look=True)
    count = int((refined.features.score > p.min_ball_score).sum())
    return count >= max(p.min_balls, p.min_negative_ratio * balls)
