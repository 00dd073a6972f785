"""What each pair of a measured stage was measured from, compressed: it is large, and read by people who doubt."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

from sqlalchemy import Text, bindparam, cast, insert, select
from sqlalchemy.orm import Session, undefer

from contract.features import ExposurePair, FeaturePair, FieldPair
from contract.pair_result import PairFeatures, PairResult
from store import tables
from store.errors import NotFoundError
from store.tables.measurements import FeatureList, Measurement
from store.tables.stages import Stage

_LEVEL = 1


def packed(pair: PairResult) -> bytes:
    """Return what is stored of a pair.

    Parameters
    ----------
    pair
        What the pair was measured from.

    Returns
    -------
    bytes
        Compressed JSON.
    """
    return zlib.compress(pair.model_dump_json().encode(), _LEVEL)


def add(session: Session, stage_id: str, pairs: Sequence[bytes]) -> None:
    """Add what the pairs of a stage were measured from.

    Parameters
    ----------
    session
        Session that writes.
    stage_id
        Identifier of the stage.
    pairs
        The pairs, ``packed``, in the order in which they were taken.
    """
    rows = [
        {"stage_id": stage_id, "pair": number, "content": content}
        for number, content in enumerate(pairs, start=1)
    ]
    if rows:
        session.connection().execute(insert(tables.measurements.PairResult), rows)


def find(session: Session, stage_id: str, pair: int) -> PairResult | None:
    """Return what a pair of a stage was measured from.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the stage.
    pair
        Number of the pair, from 1.

    Returns
    -------
    PairResult or None
        The features and the explanation; None for a stage that an earlier version measured.
    """
    row = session.get(
        tables.measurements.PairResult,
        (stage_id, pair),
        options=[undefer(tables.measurements.PairResult.content)],
    )
    return None if row is None else _unpacked(row)


def all_of(session: Session, stage_id: str) -> tuple[PairResult, ...]:
    """Return what all pairs of a stage were measured from.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the stage.

    Returns
    -------
    tuple of PairResult
        In the order in which they were taken; empty for a stage that an earlier version measured.
    """
    query = select(tables.measurements.PairResult).where(tables.measurements.PairResult.stage_id == stage_id)
    rows = session.scalars(
        query.order_by(tables.measurements.PairResult.pair).options(
            undefer(tables.measurements.PairResult.content)
        )
    )
    return tuple(map(_unpacked, rows))


def features(session: Session, stage: Stage, measured: Measurement, pair: int) -> PairFeatures | None:
    """Return the features of a pair of a measured stage.

    Parameters
    ----------
    session
        Session that reads.
    stage
        The stage.
    measured
        Its measurement.
    pair
        Number of the pair, from 1.

    Returns
    -------
    PairFeatures or None
        The features; None for a further pair of a burst that an earlier version measured.

    Raises
    ------
    NotFoundError
        The stage has no such pair.
    """
    require_pair(stage, pair)
    if pair > 1:
        found = find(session, stage.id, pair)
        return None if found is None else found.features
    lists = session.execute(_FEATURES, {"stage_id": stage.id})
    text = ",".join(f'"{side}":{points}' for side, points in lists)
    return PairFeatures(
        features=FeaturePair.model_validate_json(f"{{{text}}}"),
        fields=FieldPair.model_validate(measured.result["fields"]),
        exposure=ExposurePair.model_validate(measured.result["exposure"]),
    )


def require_pair(stage: Stage, pair: int) -> None:
    """Check that a stage has a pair.

    Parameters
    ----------
    stage
        The stage.
    pair
        Number of the pair, from 1.

    Raises
    ------
    NotFoundError
        It has none of this number.
    """
    if pair > stage.pair_count:
        raise NotFoundError("pair")


def _unpacked(row: tables.measurements.PairResult) -> PairResult:
    return PairResult.model_validate_json(zlib.decompress(row.content))


_FEATURES = select(FeatureList.side, cast(FeatureList.points, Text)).where(
    FeatureList.stage_id == bindparam("stage_id")
)
