"""What MATCH-POINT considered, as data files of text: candidate sets, and triplets as in Tables 5.4 to 5.6."""

from __future__ import annotations

import numpy as np

from spinewatch.thesis_1995.data_files import format_table
from spinewatch.thesis_1995.match_point import MatchPoint

CANDIDATES = ("left", "right", "of_left", "of_right", "refined", "correlation")
"""Columns of ``CandidateSets.dat``: pairs of features, whether the right one is in the candidate set of the left one
and the left one in that of the right one, whether the pair remains after the refinement, and the correlation of their
surroundings, ``-`` without refinement."""

TRIPLETS = (
    "number",
    "error_mm",
    "XX_left",
    "XX_right",
    "YY_left",
    "YY_right",
    "MX_left",
    "MX_right",
    "heuristic",
)
"""Columns of ``Triplets.dat``: as Tables 5.4 to 5.6; ``P`` for a triplet that passed all heuristics."""


def format_candidate_sets(found: MatchPoint) -> str:
    """Return the text of ``CandidateSets.dat``.

    Parameters
    ----------
    found
        The steps of MATCH-POINT.

    Returns
    -------
    str
        One row per pair of features that are candidates, in order of the left feature, counted from 1.
    """
    sets, refined, rho = found.sets, found.refined.pairs, found.correlation
    rows = [
        (
            str(i + 1),
            str(j + 1),
            str(int(sets.of_left[i, j])),
            str(int(sets.of_right[i, j])),
            str(int(refined[i, j])),
            "-" if rho is None else f"{rho[i, j]:.4f}",
        )
        for i, j in np.argwhere(sets.pairs)
    ]
    return format_table(CANDIDATES, rows)


def format_triplets(found: MatchPoint) -> str:
    """Return the text of ``Triplets.dat``.

    Parameters
    ----------
    found
        The steps of MATCH-POINT.

    Returns
    -------
    str
        One row per triplet that fits the marker; features count from 1.
    """
    rows = [
        (
            str(number),
            f"{triplet.error_mm:.4f}",
            *(str(feature + 1) for pair in triplet.pairs for feature in pair),
            verdict,
        )
        for number, (triplet, verdict) in enumerate(
            zip(found.features, found.selection.verdicts, strict=True), 1
        )
    ]
    return format_table(TRIPLETS, rows)
