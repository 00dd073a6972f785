"""Small rows for tests of the record and the workers."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from typing import Any

from spinewatch.imaging.header import ImageHeader
from spinewatch.rig_files.rig_json import rig_from_dict, rig_to_dict
from store import calibration_requests, calibrations, stages, surgeries
from store.calibration_requests import NewRequest, NewShot
from store.database import Database
from store.images import NewImage
from store.stages import NewStage
from store.surgeries import NewSurgery
from store.tables import Stage
from tests.paths import SAMPLES

SAMPLE = SAMPLES / "D1"
RIG = rig_from_dict(json.loads((SAMPLE / "rig.json").read_text()))
NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)


def at(seconds: float) -> datetime:
    return NOON + timedelta(seconds=seconds)


def picture(content: bytes) -> NewImage:
    return NewImage(content, ImageHeader("PNG", "image/png", 568, 416))


def sample_pair(stage: str = "PRE") -> tuple[bytes, bytes]:
    return (SAMPLE / stage / "left.png").read_bytes(), (SAMPLE / stage / "right.png").read_bytes()


def new_surgery(record: Database) -> str:
    with record.writing() as session:
        new = NewSurgery("2026-0417", ["L1", "T11", "T9", "T7"], "L1", "x")
        return surgeries.add(session, new, NOON).id


def new_stage(
    record: Database,
    surgery: str,
    name: str = "PRE",
    pair: tuple[bytes, bytes] = (b"left", b"right"),
    now: datetime = NOON,
    calibration: str | None = None,
    captured_at: datetime | None = None,
) -> Stage:
    with record.writing() as session:
        return stages.submit(
            session,
            surgeries.get(session, surgery),
            calibrations.get(session, calibration) if calibration else calibrations.add(session, RIG, now),
            NewStage(name, picture(pair[0]), picture(pair[1]), captured_at),
            now,
        )


def new_request(
    record: Database, shots: int = 2, now: datetime = NOON, captured_at: datetime | None = None
) -> str:
    """Add a request to calibrate whose last shot only verifies; return its identifier."""
    new = NewRequest(
        name="cart 1",
        control_field="pegboard-1995",
        control_points=None,
        options={"pixel_size_mm": None, "free": None, "fixed": {}, "estimate_aspect": False},
        shots=[
            NewShot(picture(b"left %d" % n), picture(b"right %d" % n), used=n < shots - 1)
            for n in range(shots)
        ],
        captured_at=captured_at,
    )
    with record.writing() as session:
        return calibration_requests.submit(session, new, now).id


def solved() -> dict[str, Any]:
    """Return a calibration document as the workers write it, in short."""
    return {"rig": rig_to_dict(RIG), "shots": [], "flags": [], "version": "0.1.0"}


def result(labels: tuple[str | None, ...] = ("L1", "T11")) -> dict[str, Any]:
    """Return a stage document as the workers write it."""
    identity = [[float(i == j) for j in range(3)] for i in range(3)]
    feature = {"x": 1.5, "y": 2.5, "score": 0.9, "sd_px": [0.1, 0.1]}
    triad: dict[str, Any] = {
        "label_reason": None,
        "model": "triad",
        "reason": None,
        "position_mm": [1.0, 2.0, 3.0],
        "position_sd_mm": [0.1, 0.1, 0.2],
        "normal": [0.0, 0.0, 1.0],
        "angles_deg": [90.0, 90.0, 0.0],
        "rotation": identity,
        "rotation_sd_deg": [1.0, 1.0, 0.5],
        "covariance": [[float(i == j) * 0.01 for j in range(6)] for i in range(6)],
        "error_mm": 0.2,
        "balls": {},
    }
    return {
        "features": {"left": [feature, feature], "right": [feature]},
        "fields": {"left": [0, 0, 568, 416], "right": [0, 0, 568, 416]},
        "exposure": {"left": "normal", "right": "normal"},
        "triads": [{"label": label, **triad} for label in labels],
        "flags": [{"code": "a-flag", "detail": "A doubt."}],
        "rig_check": None,
        "parameters": {"ball_diameter_mm": 8.0},
        "version": "0.1.0",
    }
