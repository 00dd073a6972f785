"""The way of a stage document into the tables."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from store.tables import FeatureList, Measurement, Triad

_NO_POSE = (None, None, None)


def measurement_of(stage_id: str, result: Mapping[str, Any], now: datetime) -> Measurement:
    """Return the rows of a stage document (docs/api.md) that also has ``parameters`` and ``version``."""
    return Measurement(
        stage_id=stage_id,
        flags=result["flags"],
        fields=result["fields"],
        exposure=result["exposure"],
        rig_check=result["rig_check"],
        parameters=result["parameters"],
        version=result["version"],
        created_at=now,
        features=[
            FeatureList(side=side, count=len(points), points=points)
            for side, points in result["features"].items()
        ],
        triads=[_triad(position, triad) for position, triad in enumerate(result["triads"])],
    )


def _triad(position: int, triad: Mapping[str, Any]) -> Triad:
    x, y, z = triad["position_mm"] or _NO_POSE
    x_sd, y_sd, z_sd = triad["position_sd_mm"] or _NO_POSE
    alpha, beta, gamma = triad["angles_deg"] or _NO_POSE
    return Triad(
        position=position,
        label=triad["label"],
        label_reason=triad["label_reason"],
        model=triad["model"],
        reason=triad["reason"],
        x_mm=x,
        y_mm=y,
        z_mm=z,
        x_sd_mm=x_sd,
        y_sd_mm=y_sd,
        z_sd_mm=z_sd,
        alpha_deg=alpha,
        beta_deg=beta,
        gamma_deg=gamma,
        error_mm=triad["error_mm"],
        normal=triad["normal"],
        rotation=triad["rotation"],
        rotation_sd_deg=triad["rotation_sd_deg"],
        covariance=triad["covariance"],
        balls=triad["balls"],
    )
