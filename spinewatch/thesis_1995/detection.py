"""Detection of balls as published: the parameters of DETECT-POINT (thesis chapter 4)."""

from __future__ import annotations

from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.search import Comparison, DetectionParameters
from spinewatch.detection.candidates.similarity import Measure

THESIS_1995 = DetectionParameters(
    comparisons=(
        Comparison(PropertySpace.GRAY, Measure.RHO, weight=1.0, gate=0.4),
        Comparison(PropertySpace.EDGE, Measure.CCM, weight=2.0, gate=0.4),
    ),
    median=True,
    scales=(1.0,),
    segmentation="components",
    max_features=15,
)
"""Gray levels by RHO, edges by CCM, K = 2; representatives behind a gate on the root; components of the best pixels."""
