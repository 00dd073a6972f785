"""Jobs that compute the spine of every stage of a surgery whose inputs have changed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from importlib.metadata import version

from sqlalchemy.orm import Session

from contract.event import Actor
from contract.library_setup import SurgeryLevels
from settings import Settings
from spinewatch.errors import SpinewatchError
from spinewatch.progress import Progress
from store import spines
from store.leases import Lease
from store.spines import ComputedSpine, SpineWork
from store.tables.jobs import SPINE_JOB
from workers.registry import Handler
from workers.spine_documents import SpineInputs, spine_document

_VERSION = version("spinewatch")


class SpineHandler(Handler[SpineWork, Sequence[ComputedSpine]]):
    """Computes the spines of a surgery from its setup and the triads of its stages."""

    kind = SPINE_JOB

    def load(self, session: Session, lease: Lease) -> SpineWork:
        """Return the setup, the stages and their poses.

        Parameters
        ----------
        session
            Session that reads.
        lease
            The lease on the surgery.

        Returns
        -------
        SpineWork
            The input.
        """
        return spines.work(session, lease.subject_id, _VERSION)

    def run(self, work: SpineWork, progress: Progress) -> Sequence[ComputedSpine]:
        """Return the spines of the stages that are out of date; one without a spine has the reason.

        Parameters
        ----------
        work
            Setup, stages and poses.
        progress
            Called before each stage.

        Returns
        -------
        sequence of ComputedSpine
            In the order of the stages.
        """
        if work.setup is None:
            return ()
        inputs = SpineInputs(
            surgery_id=work.setup.surgery_id,
            setup=work.setup.setup,
            revision=work.setup.revision,
            rebaselines=work.setup.rebaselines,
            levels=SurgeryLevels(work.reference_vertebra, work.extra_levels),
            stages=work.poses,
            references={plan.reference.name: plan.reference for plan in work.plans},
            radiographs=work.radiographs,
        )
        outdated = [plan for plan in work.plans if plan.stage_id in work.outdated]
        computed = []
        for done, plan in enumerate(outdated):
            name = plan.reference.name
            progress(name, done / len(outdated))
            try:
                spine, reason = spine_document(inputs, name, plan.baseline, plan.previous), None
            except SpinewatchError as error:
                spine, reason = None, str(error)
            computed.append(ComputedSpine(plan, spine, reason))
        return computed

    def store(
        self,
        session: Session,
        lease: Lease,
        result: Sequence[ComputedSpine],
        now: datetime,
        actor: Actor,
    ) -> tuple[str, ...]:
        """Add the spines whose inputs have not changed meanwhile.

        Parameters
        ----------
        session
            Session that writes.
        lease
            The lease on the surgery.
        result
            The spines.
        now
            Time of the result.
        actor
            The worker.

        Returns
        -------
        tuple of str
            A job for the spines whose inputs have changed, if none is queued.
        """
        return spines.add(session, lease.subject_id, result, _VERSION, now, actor)


def handler(settings: Settings) -> SpineHandler:
    """Return the handler of jobs that compute spines.

    Parameters
    ----------
    settings
        Not used: everything is in the setup.

    Returns
    -------
    SpineHandler
        The handler.
    """
    return SpineHandler()
