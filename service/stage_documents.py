"""Stages as documents of the API."""

from __future__ import annotations

from contract.burst import LabelSource
from contract.flag import Flag
from contract.measuring import Measuring
from contract.revision import Revision
from contract.stage import CountPair, Stage
from service.images import image_pair
from service.routes.jobs import job_of
from store import tables


def stage_document(row: tables.stages.Stage) -> Stage:
    """Return the model of a row with its images, job and measurement."""
    measured = row.measurement
    return Stage(
        id=row.id,
        surgery_id=row.surgery_id,
        name=row.name,
        take=row.take,
        calibration_id=row.calibration_id,
        captured_at=row.captured_at,
        left_exposed_at=row.left_exposed_at,
        right_exposed_at=row.right_exposed_at,
        created_at=row.created_at,
        images=image_pair(row.left, row.right),
        pairs=row.pair_count,
        state=row.job.state,
        job=job_of(row.job, row),
        features=_feature_counts(measured),
        triads=None if measured is None else measured.triad_count,
        flags=None if measured is None else [Flag(**flag) for flag in measured.result["flags"]],
        version=None if measured is None else measured.result["version"],
        labelled_by=None if measured is None else label_source(measured.result),
        revision=revision_document(row),
        measuring=_measuring(row),
    )


def _feature_counts(measured: tables.measurements.Measurement | None) -> CountPair | None:
    if measured is None or measured.left_count is None or measured.right_count is None:
        return None
    return CountPair(left=measured.left_count, right=measured.right_count)


def _measuring(row: tables.stages.Stage) -> Measuring | None:
    if row.revised_take is not None or row.changes is None:
        return None
    return Measuring.model_validate(row.changes)


def revision_document(row: tables.stages.Stage) -> Revision | None:
    """Return what a take changes of an earlier one, None for a take with images of its own."""
    if row.revised_take is None:
        return None
    return Revision.model_validate(
        {"of_take": row.revised_take, "changes": row.changes, "by": row.revised_by, "at": row.revised_at}
    )


def label_source(result: tables.base.Document) -> LabelSource | None:
    """Return what decided on the labels of a result; results of earlier versions have none."""
    source = result.get("labelled_by")
    return None if source is None else LabelSource.model_validate(source)
