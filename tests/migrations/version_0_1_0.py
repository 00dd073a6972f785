"""The record of version 0.1.0: a row of every kind."""

from datetime import UTC, datetime
from typing import Any

import numpy as np
from sqlalchemy import JSON, MetaData

from store.database import Database
from tests.migrations.databases import move

TIME = datetime(2026, 11, 21, 12, tzinfo=UTC)
RANDOM = np.random.default_rng(1)
COVARIANCE = RANDOM.random((6, 6)).tolist()
ROTATION = RANDOM.random((3, 3)).tolist()
X, Y, Z = 0.1 + 0.2, 1e-17 / 3, -1234.567890123456789
POSE = {
    "x_mm": X,
    "y_mm": Y,
    "z_mm": Z,
    "x_sd_mm": 0.1,
    "y_sd_mm": 0.2,
    "z_sd_mm": 0.3,
    "alpha_deg": 89.0,
    "beta_deg": 91.0,
    "gamma_deg": 1.4,
    "normal": [0.0, 0.0, 1.0],
    "rotation": ROTATION,
    "rotation_sd_deg": [1.0, 2.0, 3.0],
    "covariance": COVARIANCE,
}
BALL = {
    "position_mm": [1.0, 2.0, 3.0],
    "sd_mm": [0.1, 0.1, 0.1],
    "left": [5.0, 6.0],
    "right": None,
    "parallax_mm": None,
}
RIG_CHECK = {
    "balls": 12,
    "rms_px": 0.2,
    "chance": 0.3,
    "drifted": False,
    "turn_deg": [0.0, 0.1, 0.2],
    "turn_sd_deg": [0.3, 0.4, 0.5],
    "shift_mm": [0.0, 0.0, 0.0],
    "shift_sd_mm": [1.0, 1.0, 1.0],
}
REMOVED = {"side": "left", "shot": "1", "id": "A1", "miss_px": 2.5}
WORK = {
    "progress": 1.0,
    "step": None,
    "error": None,
    "attempts": 2,
    "lease_owner": None,
    "lease_until": None,
    "rung_at": TIME,
    "created_at": TIME,
    "started_at": TIME,
    "finished_at": TIME,
}
OLD: list[tuple[str, dict[str, Any]]] = [
    ("images", {"sha256": "a", "content": b"1", "media_type": "image/png", "width": 1, "height": 1}),
    ("calibrations", {"id": "r", "name": "cart", "rig": {"name": "cart"}, "calibrated_at": TIME}),
    ("calibration_requests", {"id": "r", "name": "cart", "control_field": "pegboard-1995", "options": {}}),
    ("calibration_shots", {"request_id": "r", "position": 0, "used": True}),
    ("calibration_reports", {"calibration_id": "r", "report": {"removed": [REMOVED]}, "version": "0.1.0"}),
    (
        "surgeries",
        {
            "id": "s",
            "reference": "case",
            "vertebrae": ["L1", "T11"],
            "reference_vertebra": "L1",
            "spine_axis": "x",
        },
    ),
    ("stages", {"id": "t", "surgery_id": "s", "name": "PRE", "take": 1, "calibration_id": "r"}),
    ("stages", {"id": "u", "surgery_id": "s", "name": "POST", "take": 1, "calibration_id": "r"}),
    ("jobs", {"id": "j", "stage_id": "t", "state": "succeeded", **WORK}),
    ("jobs", {"id": "k", "calibration_request_id": "r", "state": "succeeded", **WORK}),
    (
        "jobs",
        {
            "id": "l",
            "stage_id": "u",
            "state": "failed",
            **WORK,
            "error": {"code": "x", "detail": "y"},
        },
    ),
    (
        "measurements",
        {
            "stage_id": "t",
            "flags": [{"code": "calibration-old", "detail": "old"}],
            "fields": {"left": [0, 0, 1, 1], "right": [0, 0, 1, 1]},
            "exposure": {"left": "normal", "right": "dark"},
            "parameters": {"ball_diameter_mm": 8.0},
            "version": "0.1.0",
            "rig_check": RIG_CHECK,
        },
    ),
    (
        "features",
        {
            "stage_id": "t",
            "side": "left",
            "count": 1,
            "points": [{"x": 1.5, "y": 2.5, "score": 0.9, "sd_px": [0.1, 0.1]}],
        },
    ),
    ("features", {"stage_id": "t", "side": "right", "count": 0, "points": []}),
    (
        "triads",
        {
            "stage_id": "t",
            "position": 0,
            "label": "L1",
            "model": "flat-10-14-18",
            "error_mm": 0.25,
            "balls": {"XX": BALL},
            **POSE,
        },
    ),
    (
        "triads",
        {
            "stage_id": "t",
            "position": 1,
            "label": None,
            "label_reason": "the gaps do not decide",
            "model": "flat-10-14-18",
            "reason": "not determined",
            "error_mm": 0.5,
            "balls": {},
        },
    ),
    ("changes", {"seq": 1, "action": "http:surgery:created", "subject_id": "s", "surgery_id": "s"}),
    ("changes", {"seq": 4, "action": "worker:stage:measured", "subject_id": "t", "surgery_id": "s"}),
    ("changes", {"seq": 5, "action": "http:calibration:submitted", "subject_id": "r", "surgery_id": None}),
]
FILLED = {"created_at": TIME, "at": TIME, "left_sha256": "a", "right_sha256": "a", "size_bytes": 1}


def fill(empty: Database) -> None:
    """Make the tables of version 0.1.0 in an empty database, and add its rows."""
    move(empty, "0004")
    metadata = MetaData()
    metadata.reflect(empty.engine)
    with empty.write() as session:
        for name, values in OLD:
            table = metadata.tables[name]
            for column in table.columns:
                if isinstance(column.type, JSON):
                    column.type = JSON(none_as_null=True)
            filled = {key: value for key, value in FILLED.items() if key in table.columns}
            session.execute(table.insert().values({**filled, **values}))
