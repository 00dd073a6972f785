"""Limits of the diagnosis of a stereo pair that shows no triads."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DiagnosisParameters:
    """When a cause is named.

    Attributes
    ----------
    max_features
        Number of features per image, the best ones, with which causes are tried.
    min_triads
        Smallest number of triads in full view under a cause.
    min_log_odds
        Smallest log-odds of their chain, less the logarithm of the number of trials.
    min_lead
        Smallest difference of the log-odds to those of every other cause and of the pair as given.
    sizes
        Sizes of the markers that are tried, relative to the known one.
    max_rotation_deg
        Largest rotation of the right camera across the epipolar lines and about its axis, degrees.
    triplet_spread_mrad, triplet_sd_mrad
        Largest spread of the epipolar distances of a triplet's balls without a rotation about the axis, and their
        standard deviation, mrad.
    offset_tolerance_mrad
        Largest difference of a triplet's epipolar distance from a common one, mrad.
    roll_log_odds
        Log-odds by which a rotation about the axis must improve the chain.
    roll_spread
        Addition to the largest spread per unit of the largest rotation about the axis.
    min_across
        Smallest distance of two triplets across the right image, as a fraction of the focal length, from which a
        rotation about the axis is determined.
    min_offset_mrad
        Smallest epipolar offset that is tried, mrad.
    offset_separation_mrad
        Smallest difference between the offsets that are tried, mrad.
    roll_separation_weight
        Weight of the rotation about the axis in that difference.
    exchange_trials, mirror_trials
        Number of trials, for their logarithm, of exchanged images and of mirrored or turned ones; that of markers of
        another size is `exchange_trials` per size.
    max_offset_features
        Number of features per image for the epipolar offset.
    max_triplets
        Number of triplets considered together for the epipolar offset.
    max_offsets
        Number of offsets tried with a search.
    offset_trials
        Number of offsets that are distinguished, for the logarithm of the number of trials.
    range_fractions
        Range of features that may meet, when it is counted how many do.
    meeting_features
        Numbers of features per image with which it is counted.
    meeting_mrad
        Epipolar distance below which two features meet, mrad.
    meeting_offsets_mrad
        First, last and step of the offsets of comparison, mrad.
    related_sigma
        Standard deviations by which more features meet than at the offsets of comparison, from which on the images are
        taken to belong together.
    """

    max_features: int = 150
    min_triads: int = 2
    min_log_odds: float = 12.0
    min_lead: float = 7.0
    sizes: tuple[float, ...] = (0.91, 0.94, 0.97, 1.03, 1.06, 1.09)
    max_rotation_deg: float = 1.5
    triplet_spread_mrad: float = 1.2
    triplet_sd_mrad: float = 0.35
    offset_tolerance_mrad: float = 0.8
    roll_log_odds: float = 4.0
    roll_spread: float = 8.0
    min_across: float = 0.05
    min_offset_mrad: float = 0.5
    offset_separation_mrad: float = 1.0
    roll_separation_weight: float = 0.3
    exchange_trials: int = 4
    mirror_trials: int = 24
    max_offset_features: int = 70
    max_triplets: int = 60
    max_offsets: int = 3
    offset_trials: int = 200
    range_fractions: tuple[float, float] = (0.85, 1.12)
    meeting_features: tuple[int, ...] = (40, 150)
    meeting_mrad: float = 0.6
    meeting_offsets_mrad: tuple[float, float, float] = (3.0, 30.0, 0.65)
    related_sigma: float = 4.0
