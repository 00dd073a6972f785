"""Why a pair was measured as it was: the candidates of balls and triads, and what rejected those not chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from annotated_types import Len
from pydantic import ConfigDict, Field

from contract.base import Identifier, Schema, StageName
from spinewatch.arrays import Float
from spinewatch.matching.rejections import HEURISTICS, FeatureRejection, Heuristic, TriadRejection

if TYPE_CHECKING:
    import spinewatch.detection.candidates.search
    import spinewatch.stage
    import spinewatch.triads.explanation

MAX_POINTS = 2000
"""Points of one explanation, the most likely first."""

MAX_TRIADS = 1000
"""Candidate triads of one explanation, the most likely first."""

_DECIMALS = 4
"""Decimals of the numbers of an explanation; the results have all of them."""


class CandidateRejection(StrEnum):
    """Why a candidate is not among the features."""

    SAME_BALL = "same-ball"
    LOW_SCORE = "low-score"


FeatureIndex = Annotated[
    int, Field(ge=0, description="Place of a feature in `features` of the stage and pair, from 0.")
]
Features = Annotated[list[FeatureIndex | None], Len(3, 4)]
Place = Annotated[list[float], Len(3, 3)]
"""Not `contract.base.Vector3`, whose conversion of arrays costs a millisecond per explanation."""


class FeatureUse(Schema):
    """What became of a feature; there is one for each of `features`, in their order."""

    candidate: Annotated[
        int | None,
        Field(description="Place in `triads` below of the chosen candidate triad that it belongs to."),
    ]
    ball: Annotated[str | None, Field(description="Name of its ball in that triad: XX, YY, MX.")]
    reason: Annotated[
        FeatureRejection | None,
        Field(
            description="Why it belongs to none: no-partner, there is no feature of the other image on its epipolar"
            " segment; no-triad, no points with it fit a marker; rejected, they do, and all were rejected."
        ),
    ]


class DiscardedCandidate(Schema):
    """A candidate of the search by templates that is not among the features."""

    x: Annotated[float, Field(description="u to the right, px; 0 is the centre of the first pixel.")]
    y: Annotated[float, Field(description="v downwards, px.")]
    score: Annotated[float, Field(description="Similarity to a ball, 0 to 1.")]
    reason: Annotated[
        CandidateRejection,
        Field(
            description="same-ball, it is the ball of a feature with a higher score; low-score, there were more"
            " candidates than are kept."
        ),
    ]
    feature: Annotated[
        int | None,
        Field(
            description="Place of the feature that is the same ball, from 0; null for others, and when it was removed."
        ),
    ]


class ImageCandidates(Schema):
    """The candidates of balls in one image."""

    features: Annotated[
        list[FeatureUse], Field(description="What became of each feature, in the order of `features`.")
    ]
    discarded: Annotated[
        list[DiscardedCandidate], Field(description="Candidates that are no features, best score first.")
    ]


class CandidatePoint(Schema):
    """A left and a right feature that may be images of one ball."""

    left: Annotated[int, Field(ge=0, description="Place of the left feature, from 0.")]
    right: Annotated[int, Field(ge=0, description="Place of the right feature, from 0.")]
    position_mm: Annotated[Place, Field(description="Their point in object space, mm.")]
    parallax_mm: Annotated[float, Field(description="Distance between their rays, mm.")]
    log_odds: Annotated[float, Field(description="Log-odds of one ball, from the parallax.")]


class CandidateTriad(Schema):
    """Features that may be images of one marker."""

    model: Annotated[str, Field(description="Name of the triad model.")]
    left: Annotated[
        Features,
        Field(description="Left feature of each ball, in the order of `balls`; null where it is hidden."),
    ]
    right: Annotated[
        Features,
        Field(description="Right feature of each ball, in the order of `balls`; null where it is hidden."),
    ]
    balls: Annotated[list[str], Field(description="Names of the balls: XX, YY, MX.")]
    position_mm: Annotated[Place, Field(description="Approximate position of P in object space, mm.")]
    error_mm: Annotated[
        float, Field(description="Distance-matrix error of the balls that both images show, mm.")
    ]
    log_odds: Annotated[
        float | None,
        Field(
            description="Log-odds of a triad, on its own; null when it was rejected before they were computed."
        ),
    ]
    triad: Annotated[
        int | None,
        Field(description="Place in `triads` of the stage, from 0; null when it is not one of them."),
    ]
    reason: Annotated[
        TriadRejection | None, Field(description="Why it was rejected; null when it was chosen.")
    ]
    heuristic: Annotated[
        Heuristic | None,
        Field(description="Heuristic of the thesis that this reason stands for; null when it has none."),
    ]
    rival: Annotated[
        int | None,
        Field(
            description="Place in `triads` below of the chosen candidate that excludes it; null for others."
        ),
    ]


class Explanation(Schema):
    """What one pair of images was measured from: candidates, points and candidate triads."""

    method: Annotated[
        str, Field(description="Method that measured: `default` or `thesis-1995`.", examples=["default"])
    ] = "default"
    left: Annotated[ImageCandidates, Field(description="Candidates of balls in the left image.")]
    right: Annotated[ImageCandidates, Field(description="Candidates of balls in the right image.")]
    points: Annotated[list[CandidatePoint], Field(description="Matched features, the most likely first.")]
    points_left_out: Annotated[
        int, Field(ge=0, description=f"Number of points beyond {MAX_POINTS}, which are left out.")
    ]
    triads: Annotated[
        list[CandidateTriad],
        Field(
            description="Candidate triads: the chosen ones along the spine, then the rejected ones, the most likely"
            " first."
        ),
    ]
    triads_left_out: Annotated[
        int, Field(ge=0, description=f"Number of candidate triads beyond {MAX_TRIADS}, which are left out.")
    ]

    @classmethod
    def of(cls, measurement: spinewatch.stage.StageMeasurement) -> Explanation | None:
        """Return the contract model of the explanation of a measurement; None when it has none."""
        found = measurement.explanation
        if found is None:
            return None
        labelled = {id(triad.triad): place for place, triad in enumerate(measurement.triads)}
        places = [labelled.get(id(triad)) for triad in found.triads]
        verdicts = found.verdicts[:MAX_TRIADS]
        positions = _rounded(np.array([verdict.position_mm for verdict in verdicts]).reshape(-1, 3))
        triads = [
            _triad(verdict, position, places[k] if k < len(places) else None)
            for k, (verdict, position) in enumerate(zip(verdicts, positions, strict=True))
        ]
        points = found.points.take(np.arange(min(len(found.points), MAX_POINTS)))
        return cls.model_validate(  # at once: one call for each of a thousand models takes twice as long
            {
                "method": found.method,
                "left": _candidates(measurement.left, found.uses[0]),
                "right": _candidates(measurement.right, found.uses[1]),
                "points": [
                    {
                        "left": i,
                        "right": j,
                        "position_mm": position,
                        "parallax_mm": parallax,
                        "log_odds": odds,
                    }
                    for i, j, position, parallax, odds in zip(
                        points.left_index.tolist(),
                        points.right_index.tolist(),
                        _rounded(points.position_mm),
                        _rounded(points.parallax_mm),
                        _rounded(points.log_odds),
                        strict=True,
                    )
                ],
                "points_left_out": max(len(found.points) - MAX_POINTS, 0),
                "triads": triads,
                "triads_left_out": max(len(found.verdicts) - MAX_TRIADS, 0),
            }
        )

    def placed(self, places: Mapping[int, int | None]) -> Explanation:
        """Return the explanation with new places of its triads; one that is not named was removed by a person."""
        return self.model_copy(update={"triads": [_placed(triad, places) for triad in self.triads]})


class StageCandidates(Schema):
    """The candidates of a measured stage, and what rejected those not chosen."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "surgery_id": "5f0c86c4-5c58-4cb0-a8a6-6d3f4e9b7a11",
                    "stage": "PRE",
                    "take": 1,
                    "pair": 1,
                    "explanation": {
                        "method": "default",
                        "left": {
                            "features": [{"candidate": 0, "ball": "XX", "reason": None}],
                            "discarded": [
                                {"x": 31.2, "y": 8.5, "score": 0.31, "reason": "same-ball", "feature": 0}
                            ],
                        },
                        "right": {
                            "features": [{"candidate": None, "ball": None, "reason": "no-partner"}],
                            "discarded": [],
                        },
                        "points": [],
                        "points_left_out": 0,
                        "triads": [],
                        "triads_left_out": 0,
                    },
                }
            ]
        }
    )

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    stage: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    pair: Annotated[int, Field(ge=1, description="Number of the pair; 1 unless the stage is a burst.")]
    explanation: Annotated[
        Explanation | None,
        Field(description="Null for a take that was measured by a version that did not keep it."),
    ]


def _rounded(values: Float) -> Any:
    return np.round(values, _DECIMALS).tolist()


def _triad(
    verdict: spinewatch.triads.explanation.TriadVerdict, position_mm: list[float], place: int | None
) -> dict[str, Any]:
    """Return the values of a ``CandidateTriad``."""
    reason = TriadRejection.REMOVED if verdict.reason is None and place is None else verdict.reason
    return {
        "model": verdict.model.name,
        "left": [None if i < 0 else i for i in verdict.left.tolist()],
        "right": [None if i < 0 else i for i in verdict.right.tolist()],
        "balls": list(verdict.model.balls),
        "position_mm": position_mm,
        "error_mm": round(verdict.error_mm, _DECIMALS),
        "log_odds": None if verdict.log_odds is None else round(verdict.log_odds, _DECIMALS),
        "triad": place,
        "reason": reason,
        "heuristic": None if reason is None else HEURISTICS.get(reason),
        "rival": verdict.rival,
    }


def _placed(triad: CandidateTriad, places: Mapping[int, int | None]) -> CandidateTriad:
    if triad.triad is None:
        return triad
    if triad.triad not in places:
        return triad.model_copy(update={"triad": None, "reason": TriadRejection.REMOVED})
    return triad.model_copy(update={"triad": places[triad.triad]})


def _candidates(
    detection: spinewatch.detection.candidates.search.Detection,
    uses: Sequence[spinewatch.triads.explanation.FeatureUse],
) -> dict[str, Any]:
    """Return the values of an ``ImageCandidates``."""
    discarded = detection.discarded
    return {
        "features": [{"candidate": use.triad, "ball": use.ball, "reason": use.reason} for use in uses],
        "discarded": [
            {
                "x": x,
                "y": y,
                "score": score,
                "reason": CandidateRejection.SAME_BALL if same else CandidateRejection.LOW_SCORE,
                "feature": None if feature < 0 else feature,
            }
            for (x, y), score, same, feature in zip(
                _rounded(discarded.xy_px),
                _rounded(discarded.score),
                discarded.same_ball.tolist(),
                discarded.feature.tolist(),
                strict=True,
            )
        ],
    }
