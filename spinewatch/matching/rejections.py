"""Why candidates were not chosen, and the heuristics of the thesis that these reasons stand for."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum


class Heuristic(StrEnum):
    """Heuristic that discards triplets (thesis section 5.6)."""

    H1 = "H1"
    H2 = "H2"
    H3 = "H3"
    H4 = "H4"
    H5 = "H5"


class TriadRejection(StrEnum):
    """Why a candidate triad was not chosen."""

    FEATURE_TWICE = "feature-twice"
    DISTANCES = "distances"
    MIRRORED = "mirrored"
    TILT = "tilt"
    NOT_CONSIDERED = "not-considered"
    POINT_TAKEN = "point-taken"
    FEATURE_TAKEN = "feature-taken"
    TOO_NEAR = "too-near"
    IMPROBABLE = "improbable"
    SPACING = "spacing"
    COUNT = "count"
    REMOVED = "removed"


class FeatureRejection(StrEnum):
    """Why a feature is no ball of a chosen triad."""

    NO_PARTNER = "no-partner"
    NO_TRIAD = "no-triad"
    REJECTED = "rejected"


HEURISTICS: Mapping[TriadRejection, Heuristic] = {
    TriadRejection.FEATURE_TWICE: Heuristic.H1,
    TriadRejection.POINT_TAKEN: Heuristic.H2,
    TriadRejection.FEATURE_TAKEN: Heuristic.H3,
    TriadRejection.SPACING: Heuristic.H4,
    TriadRejection.COUNT: Heuristic.H5,
}
"""The heuristic that a reason stands for; the others have none."""
