"""Why a calibration cannot be made; each message says what to do about it."""

from __future__ import annotations

from spinewatch.errors import SpinewatchError


class CalibrationError(SpinewatchError):
    """Base of every reason for which a calibration is refused."""

    code = "calibration-failed"


class ControlFieldError(CalibrationError):
    """A control field cannot be used: not finite, too few points, doubled ids or coordinates, unknown name."""

    code = "invalid-control-field"


class PointsError(CalibrationError):
    """Image points cannot be used: not finite, doubled, or not of the control field."""

    code = "invalid-points"


class TooFewPointsError(CalibrationError):
    """A camera sees fewer control points than its parameters need."""

    code = "too-few-points"


class PlanarFieldError(CalibrationError):
    """The control points of a single view lie nearly in one plane: focal length and range cannot be told apart."""

    code = "planar-field"


class UndeterminedError(CalibrationError):
    """The points do not determine the camera; ``names`` are the parameters that they leave open."""

    code = "undetermined"

    def __init__(self, message: str, names: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.names = names


class ConvergenceError(CalibrationError):
    """No start leads to a camera that sees the control points."""

    code = "not-converged"


class PoorFitError(CalibrationError):
    """The best camera misses the image points by more than a camera and careful pointing can."""

    code = "poor-fit"


class MirroredFieldError(CalibrationError):
    """Image and object coordinates have opposite handedness."""

    code = "mirrored-field"


class BoardOrientationError(CalibrationError):
    """The board lies upside down: its X runs to the left in the images, or its Z away from the cameras."""

    code = "board-upside-down"


class SidesSwappedError(CalibrationError):
    """Left and right are exchanged."""

    code = "left-right-swapped"


class TargetsNotFoundError(CalibrationError):
    """An image shows too few targets."""

    code = "targets-not-found"


class IdentificationError(CalibrationError):
    """The targets of an image fit no part of the control field, or several equally well."""

    code = "targets-not-identified"
