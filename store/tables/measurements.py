"""Tables of what was measured from a stage."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any

from sqlalchemy import JSON, ForeignKey, LargeBinary, ScalarSelect, String, func, select
from sqlalchemy.orm import Mapped, column_property, mapped_column, relationship

from store.tables.base import Base, Document

if TYPE_CHECKING:
    from store.tables.stages import Stage


class Triad(Base):
    """A triad of a measured stage (``contract.triad.Triad``); ``position`` counts a stage's triads from 0."""

    __tablename__ = "triads"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    label: Mapped[str | None] = mapped_column(String(16))
    triad: Mapped[Document]


class FeatureList(Base):
    """The features of one image (``contract.features.Feature``), best score first, and a strip of it.

    ``strip`` is None for a revision, whose images are those of the take that it revises, for an image without a whole
    tile, and for results of versions before migration 0020.
    """

    __tablename__ = "features"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    side: Mapped[str] = mapped_column(String(8), primary_key=True)
    count: Mapped[int]
    points: Mapped[list[Any]] = mapped_column(JSON, deferred=True)
    strip: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)


def _feature_count(stage_id: Mapped[str], side: str) -> ScalarSelect[int]:
    """Return the query for the number of features in one image of a stage."""
    query = select(FeatureList.count).where(FeatureList.stage_id == stage_id, FeatureList.side == side)
    return query.correlate_except(FeatureList).scalar_subquery()


class Measurement(Base):
    """The result of a stage: ``contract.stage.StageResult`` without features and triads, which have tables."""

    __tablename__ = "measurements"

    stage_id: Mapped[str] = mapped_column(ForeignKey("stages.id"), primary_key=True)
    result: Mapped[Document]
    created_at: Mapped[datetime]

    stage: Mapped[Stage] = relationship(back_populates="measurement", lazy="raise")
    features: Mapped[list[FeatureList]] = relationship(lazy="raise", order_by="FeatureList.side")
    burst: Mapped[Burst | None] = relationship(lazy="raise")
    triad_count: Mapped[int] = column_property(
        select(func.count())
        .select_from(Triad)
        .where(Triad.stage_id == stage_id)
        .correlate_except(Triad)
        .scalar_subquery()
    )
    left_count: Mapped[int | None] = column_property(_feature_count(stage_id, "left"))
    right_count: Mapped[int | None] = column_property(_feature_count(stage_id, "right"))


class Burst(Base):
    """The burst of a stage (``contract.burst.Burst``); a stage of a single pair has none."""

    __tablename__ = "bursts"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    burst: Mapped[Document]


class PairResult(Base):
    """What a pair of a stage was measured from (``contract.pair_result.PairResult``), as compressed JSON."""

    __tablename__ = "pair_results"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    pair: Mapped[int] = mapped_column(primary_key=True)
    content: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
