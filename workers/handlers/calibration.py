"""Jobs that calibrate a rig from images of a control field."""

from __future__ import annotations

from datetime import datetime
from importlib.metadata import version

from sqlalchemy.orm import Session

from contract.calibration import CalibrationResult
from contract.calibration_quality import calibration_result
from contract.event import Actor
from settings import Settings
from spinewatch.calibration.files import ShotFiles, calibrate_files, load_control_field, solve_parameters
from spinewatch.calibration.from_images import CalibrationParameters
from spinewatch.progress import Progress
from spinewatch.rig_plausibility import check_plausible_rig
from store import calibration_requests, calibrations
from store.calibration_requests import CalibrationWork
from store.leases import Lease
from store.tables.jobs import CALIBRATION_JOB
from workers.registry import Handler

_VERSION = version("spinewatch")


class CalibrationHandler(Handler[CalibrationWork, CalibrationResult]):
    """Calibrates a rig from the images of a request."""

    kind = CALIBRATION_JOB

    def load(self, session: Session, lease: Lease) -> CalibrationWork:
        """Return the images, control field and options of the request.

        Parameters
        ----------
        session
            Session that reads.
        lease
            The lease on the request.

        Returns
        -------
        CalibrationWork
            The input.
        """
        return calibration_requests.work(session, lease.subject_id)

    def run(self, work: CalibrationWork, progress: Progress) -> CalibrationResult:
        """Return the rig and its quality; shots are named "1", "2" and so on.

        Parameters
        ----------
        work
            The images, control field and options.
        progress
            Called at the start of each step.

        Returns
        -------
        CalibrationResult
            The result.

        Raises
        ------
        SpinewatchError
            The images determine no calibration.
        """
        pixel_size = work.options["pixel_size_mm"]
        parameters = CalibrationParameters(
            pixel_size_mm=None if pixel_size is None else (pixel_size[0], pixel_size[1]),
            solve=solve_parameters(
                work.options["free"], work.options["fixed"], work.options["estimate_aspect"]
            ),
        )
        result = calibrate_files(
            [ShotFiles(str(number), *pair) for number, pair in enumerate(work.pairs, start=1)],
            load_control_field(work.control_field, work.control_points),
            parameters,
            progress,
            verify=work.verify,
            rig_name=work.name,
        )
        rig = result.calibration.rig  # stages only take rigs that pass, and a stored one never changes
        check_plausible_rig(rig)
        return calibration_result(result, _VERSION)

    def store(
        self, session: Session, lease: Lease, result: CalibrationResult, now: datetime, actor: Actor
    ) -> tuple[str, ...]:
        """Add the calibration under the identifier of the request.

        Parameters
        ----------
        session
            Session that writes.
        lease
            The lease on the request.
        result
            The rig and its quality.
        now
            Time of the result.
        actor
            The worker.

        Returns
        -------
        tuple of str
            Empty: no job follows.
        """
        calibrations.add_solved(session, lease.subject_id, result, now, actor)
        return ()


def handler(settings: Settings) -> CalibrationHandler:
    """Return the handler of jobs that calibrate.

    Parameters
    ----------
    settings
        Not used: all options are in the request.

    Returns
    -------
    CalibrationHandler
        The handler.
    """
    return CalibrationHandler()
