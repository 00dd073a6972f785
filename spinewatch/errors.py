"""Named errors of the measuring library; each message states what is wrong and what to do."""

from __future__ import annotations


class SpinewatchError(Exception):
    """Base of every error whose message may be shown to users unchanged."""

    code = "spinewatch-error"
    """Stable name of the kind of error, for machines."""


class RigError(SpinewatchError):
    """A rig description is incomplete, not finite or impossible.

    Parameters
    ----------
    field
        Path of the offending entry, for example ``left.focal_length_mm``.
    problem
        What is wrong with it and what to do.
    """

    code = "invalid-rig"

    def __init__(self, field: str, problem: str) -> None:
        super().__init__(f"rig field {field!r} {problem}")
        self.field = field
        self.problem = problem


class ImageError(SpinewatchError):
    """An image cannot be read or used: not an image, damaged, too large, or of an unsupported kind."""

    code = "invalid-image"


class ImageSizeError(ImageError):
    """An image's size is not the one that its camera was calibrated with."""

    code = "image-size-mismatch"


class SameImageError(ImageError):
    """Left and right are the same image, so that there is no parallax to measure."""

    code = "same-image-twice"


class ParameterError(SpinewatchError):
    """A parameter is outside the range in which its step is defined."""

    code = "invalid-parameter"


class NetworkFileError(SpinewatchError):
    """A file of detection networks cannot be read."""

    code = "invalid-network-file"


class MissingPackageError(SpinewatchError):
    """A package that only some outputs need is not installed, or a library that it loads.

    Parameters
    ----------
    output
        What needs it.
    package
        Name of the package.
    install
        What to install, as a command or in words.
    """

    code = "missing-package"

    def __init__(self, output: str, package: str, install: str) -> None:
        super().__init__(f"{output} needs {package}; install it: {install}")
        self.package = package
