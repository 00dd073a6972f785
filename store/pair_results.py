"""What each pair of a measured stage was measured from, compressed: it is large, and read by people who doubt."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session, undefer

from contract.pair_result import PairFeatures, PairResult
from store import tables
from store.errors import NotFoundError
from store.tables.measurements import FeatureList, Measurement
from store.tables.stages import Stage

_LEVEL = 6


def add(session: Session, stage_id: str, pairs: Sequence[PairResult]) -> None:
    """Add what the pairs of a stage were measured from.

    Parameters
    ----------
    session
        Session that writes.
    stage_id
        Identifier of the stage.
    pairs
        The pairs, in the order in which they were taken.
    """
    session.add_all(
        tables.measurements.PairResult(stage_id=stage_id, pair=number, content=_packed(pair))
        for number, pair in enumerate(pairs, start=1)
    )


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
        The stage, with its further pairs.
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
    query = select(FeatureList).where(FeatureList.stage_id == stage.id).options(undefer(FeatureList.points))
    return PairFeatures.model_validate(
        {
            "features": {row.side: row.points for row in session.scalars(query)},
            "fields": measured.result["fields"],
            "exposure": measured.result["exposure"],
        }
    )


def require_pair(stage: Stage, pair: int) -> None:
    """Check that a stage has a pair.

    Parameters
    ----------
    stage
        The stage, with its further pairs.
    pair
        Number of the pair, from 1.

    Raises
    ------
    NotFoundError
        It has none of this number.
    """
    if pair > 1 + len(stage.further_pairs):
        raise NotFoundError("pair")


def _packed(pair: PairResult) -> bytes:
    return zlib.compress(pair.model_dump_json().encode(), _LEVEL)


def _unpacked(row: tables.measurements.PairResult) -> PairResult:
    return PairResult.model_validate_json(zlib.decompress(row.content))
