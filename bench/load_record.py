"""What the database has of the stages that were sent: none lost, none twice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from sqlalchemy import func, select

from bench.load_service import LoadService
from store.tables.events import Event
from store.tables.jobs import STAGE_JOB, Job
from store.tables.measurements import FeatureList, Measurement
from store.tables.stages import Stage

_MEASURED = "stage:measured"
_SIDES = 2


@dataclass(frozen=True)
class Ledger:
    """Counts over the stages of some surgeries.

    Attributes
    ----------
    expected
        Number of stages that were sent.
    lost
        Number of stages without a row, a result or the record that they were measured.
    doubled
        Number of rows beyond one of a stage, of a job, of a result or of that record.
    """

    expected: int
    lost: int
    doubled: int

    @classmethod
    def total(cls, ledgers: Iterable[Ledger]) -> Ledger:
        """Return the counts of several records together."""
        every = tuple(ledgers)
        return cls(
            sum(one.expected for one in every),
            sum(one.lost for one in every),
            sum(one.doubled for one in every),
        )

    @property
    def is_exactly_once(self) -> bool:
        """Whether nothing is lost and nothing is there twice."""
        return self.lost == self.doubled == 0

    @property
    def text(self) -> str:
        """The counts."""
        return f"{self.expected} sent, {self.lost} lost, {self.doubled} doubled"


def count(service: LoadService, expected: Mapping[str, int]) -> Ledger:
    """Return the counts of surgeries; ``expected`` is the number of stages that were sent to each."""
    database = service.database()
    try:
        with database.read() as session:
            names: Counter[tuple[str, str]] = Counter()
            ids: dict[str, tuple[str, str]] = {}
            for surgery in expected:
                for stage_id, name in session.execute(
                    select(Stage.id, Stage.name).where(Stage.surgery_id == surgery)
                ):
                    ids[stage_id] = (surgery, name)
                    names[ids[stage_id]] += 1
            per_stage = [
                _counts(session.execute(select(column, func.count()).where(*where).group_by(column)).all())
                for column, where in (
                    (Job.subject_id, (Job.kind == STAGE_JOB,)),
                    (Measurement.stage_id, ()),
                    (Event.subject_id, (Event.action == _MEASURED,)),
                )
            ]
            sides = _counts(
                session.execute(
                    select(FeatureList.stage_id, func.count()).group_by(FeatureList.stage_id)
                ).all()
            )
    finally:
        database.close()
    stages = Counter(surgery for surgery, _ in names)
    lost = sum(max(n - stages[surgery], 0) for surgery, n in expected.items())
    lost += sum(any(not counts[s] for counts in per_stage) or sides[s] < _SIDES for s in ids)
    doubled = sum(n - 1 for n in names.values()) + sum(max(stages[s] - n, 0) for s, n in expected.items())
    doubled += sum(counts[s] > 1 for counts in per_stage for s in ids) + sum(sides[s] > _SIDES for s in ids)
    return Ledger(sum(expected.values()), lost, doubled)


def _counts(rows: object) -> Counter[str]:
    return Counter(dict(rows))  # type: ignore[call-overload]
