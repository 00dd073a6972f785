"""What was found in one pair of a stage, as it is stored."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Schema
from contract.explanation import Explanation
from contract.features import ExposurePair, FeaturePair, FieldPair


class PairFeatures(Schema):
    """The features of a pair after the first one of a burst, and where and how they were searched."""

    features: Annotated[FeaturePair, Field(description="Possible ball centres.")]
    fields: Annotated[FieldPair, Field(description="The surgical fields that were searched.")]
    exposure: Annotated[ExposurePair, Field(description="How the images are exposed.")]


class PairResult(Schema):
    """What is stored of a pair beside the result of its stage."""

    features: Annotated[
        PairFeatures | None,
        Field(description="Null for the first pair, whose features are those of the stage."),
    ] = None
    explanation: Annotated[
        Explanation | None, Field(description="What the pair was measured from; null when it was not kept.")
    ] = None
