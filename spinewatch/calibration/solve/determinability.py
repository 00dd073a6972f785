"""Determinability: which interior parameters of a camera the points determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.calibration.errors import UndeterminedError
from spinewatch.calibration.points import Sensor
from spinewatch.calibration.solve.bundle import BundleAdjustment


@dataclass(frozen=True)
class DeterminabilityParameters:
    """Standard deviations above which an interior parameter counts as undetermined.

    Attributes
    ----------
    focal_length
        Of f, as a fraction of it.
    principal_point
        Of x0 and y0, as a fraction of the plate's width and height.
    distortion
        Of K1, K2, P1 and P2: their effect at the corner of the plate as a fraction of the corner's radius.
    aspect
        Of py/px.
    """

    focal_length: float = 0.25
    principal_point: float = 0.5
    distortion: float = 0.2
    aspect: float = 0.05

    def max_sd(self, sensor: Sensor, focal_length_mm: float) -> dict[str, float]:
        """Return the greatest standard deviation of each determined interior parameter.

        Parameters
        ----------
        sensor
            The sensor.
        focal_length_mm
            f, mm.

        Returns
        -------
        dict of str to float
            Limit by parameter, mm and 1/mm^k.
        """
        width, height = sensor.plate_mm
        corner = float(np.hypot(width, height)) / 2
        return {
            "f": self.focal_length * focal_length_mm,
            "x0": float(self.principal_point * width),
            "y0": float(self.principal_point * height),
            "K1": self.distortion / corner**2,
            "K2": self.distortion / corner**4,
            "P1": self.distortion / corner,
            "P2": self.distortion / corner,
            "aspect": self.aspect,
        }


def undetermined(
    adjustment: BundleAdjustment, sensor: Sensor, parameters: DeterminabilityParameters | None = None
) -> tuple[str, ...]:
    """Return the interior parameters that the points of one camera do not determine.

    Parameters
    ----------
    adjustment
        Adjustment of a block of one camera.
    sensor
        Its sensor.
    parameters
        Greatest standard deviations.

    Returns
    -------
    tuple of str
        Names of free parameters whose standard deviation is too large; all free parameters when the normal equations
        are singular; none without redundancy, which leaves no standard deviation.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints
    >>> from spinewatch.calibration.solve.block import Block
    >>> from spinewatch.calibration.solve.bundle import adjust
    >>> from spinewatch.geometry.transforms import RigidTransform
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, field = table_3_3_rig().left, pegboard_1995()
    >>> image = ImagePoints.build(field.ids, field.points_mm, camera.project(field.points_mm))
    >>> block = Block((camera,), (RigidTransform.identity(),), {(0, 0): image}, (("Z0", "f", "K1"),))
    >>> undetermined(adjust(block), Sensor.of_camera(camera))
    ()
    """
    parameters = parameters or DeterminabilityParameters()
    block = adjustment.block
    if not adjustment.is_determined:
        return block.free[0]
    if block.dof <= 0:
        return ()
    limits = parameters.max_sd(sensor, block.cameras[0].focal_length_mm)
    sd = adjustment.camera_sd(0)
    return tuple(n for n in block.free[0] if n in limits and not sd[n] < limits[n])


def check_determined(
    adjustment: BundleAdjustment,
    sensor: Sensor,
    where: str,
    parameters: DeterminabilityParameters | None = None,
) -> None:
    """Check that the points determine all interior parameters of one camera.

    Parameters
    ----------
    adjustment
        Adjustment of a block of one camera.
    sensor
        Its sensor.
    where
        Name of the camera in error messages.
    parameters
        Greatest standard deviations.

    Raises
    ------
    UndeterminedError
        If they do not; its ``names`` are those parameters.
    """
    if names := undetermined(adjustment, sensor, parameters):
        raise UndeterminedError(
            f"{where}: the points do not determine {', '.join(names)}; show more points, over the whole image and at"
            " different heights, or fix these parameters",
            names,
        )
