"""What is known of triads before they are seen, and limits of their selection."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from spinewatch.matching.chain import ChainParameters

SpineAxis = Literal["x", "y", "auto"]


@dataclass(frozen=True)
class SelectionParameters:
    """Prior knowledge of triads, and limits of their selection.

    Attributes
    ----------
    tilt_sd_deg
        Standard deviation per axis of the tilt of a marker's z from the direction of the cameras, degrees.
    max_tilt_deg
        Largest tilt, degrees.
    score_weight
        Difference of the mean standardized feature scores of balls and of all features.
    assumed_count
        Number of triads assumed for the prior odds when it is not given.
    max_count
        Largest number of triads selected when it is not given.
    min_volume_mm3
        Smallest volume in which chance triads are taken to be distributed, mm^3; a few points do not span it.
    max_candidates
        Number of candidates considered, the most likely first.
    surplus_log_odds
        Log-odds, beyond `ChainParameters.min_log_odds`, that each triad beyond the expected number must add to the
        chain; 2.3 is 10 to 1.
    chain
        Prior knowledge of the chain of triads.
    """

    tilt_sd_deg: float = 18.0
    max_tilt_deg: float = 65.0
    score_weight: float = 0.7
    assumed_count: int = 5
    max_count: int = 12
    min_volume_mm3: float = 200.0**3
    max_candidates: int = 200
    surplus_log_odds: float = 2.3
    chain: ChainParameters = field(default_factory=ChainParameters)
