"""Reasons for which a calibration is refused; each message states what to do."""

from __future__ import annotations

from spinewatch.errors import SpinewatchError


class CalibrationError(SpinewatchError):
    """Base of all reasons for which a calibration is refused."""

    code = "calibration-failed"


class ControlFieldError(CalibrationError):
    """A control field cannot be used: not finite, empty, duplicate ids or coordinates, unknown name."""

    code = "invalid-control-field"


class PointsError(CalibrationError):
    """Image points cannot be used: not finite, duplicate, or inconsistent between images."""

    code = "invalid-points"


class TooFewPointsError(CalibrationError):
    """An image shows fewer control points than the parameters of its camera need."""

    code = "too-few-points"


class PlanarFieldError(CalibrationError):
    """The control points of a single image lie nearly in one plane: focal length and range are not separable."""

    code = "planar-field"


class UndeterminedError(CalibrationError):
    """The points do not determine the camera.

    Parameters
    ----------
    message
        What is wrong and what to do.
    names
        The parameters that the points do not determine.
    """

    code = "undetermined"

    def __init__(self, message: str, names: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.names = names


class ConvergenceError(CalibrationError):
    """No initial value leads to a camera that has the control points in view."""

    code = "not-converged"


class PoorFitError(CalibrationError):
    """The image residuals of the best camera exceed what a camera and careful measurement explain."""

    code = "poor-fit"


class MirroredFieldError(CalibrationError):
    """Image and object coordinates have opposite handedness."""

    code = "mirrored-field"


class BoardOrientationError(CalibrationError):
    """The board is upside down: its X runs to the left in the images, or its Z away from the cameras."""

    code = "board-upside-down"


class SidesSwappedError(CalibrationError):
    """Left and right are exchanged."""

    code = "left-right-swapped"


class TargetsNotFoundError(CalibrationError):
    """An image shows too few targets."""

    code = "targets-not-found"


class IdentificationError(CalibrationError):
    """The targets of an image fit no part of the control field, or several parts equally well."""

    code = "targets-not-identified"


class PixelSizeError(CalibrationError):
    """The pixel size is in another unit, or its aspect is not that of the image points."""

    code = "implausible-pixel-size"


class ImplausibleCalibrationError(CalibrationError):
    """The adjusted cameras cannot be those of a stereo rig, or the fit determines nothing."""

    code = "implausible-calibration"


class ShotsDisagreeError(CalibrationError):
    """Several shots do not agree with one pair of cameras: images of another order, side or moment."""

    code = "shots-disagree"
