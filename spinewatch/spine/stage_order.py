"""Which stages the spine of a stage is compared with, the baseline and the stage before; what the baseline needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from spinewatch.errors import ParameterError
from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.triads.pose import Pose


class BaselineMissingError(ParameterError):
    """The baseline stage has no result."""

    code = "baseline-missing"


@dataclass(frozen=True)
class Comparison:
    """The stages that a stage is compared with.

    Attributes
    ----------
    baseline
        Name of the baseline stage.
    previous
        Name of the stage before, of those with a pose of the reference triad; None for the first one.
    """

    baseline: str
    previous: str | None


def comparisons(
    first: str, measured: Sequence[tuple[str, bool]], named: str | None = None
) -> tuple[Comparison, ...]:
    """Return the stages that each measured stage of a surgery is compared with.

    The initial configuration is that of the patient before the correction. No later stage takes the place of a first
    one that has no result or no pose of the reference triad: it would be given the poses from before its own motion.

    Parameters
    ----------
    first
        Name of the first stage of the surgery, measured or not.
    measured
        Name of each measured stage in their order, and whether it has a pose of the reference triad.
    named
        Name of the stage that the setup names as the baseline; None for the first one.

    Returns
    -------
    tuple of Comparison
        One per measured stage, in the same order.

    Examples
    --------
    >>> [c.previous for c in comparisons("PRE", [("PRE", True), ("INTER", False), ("POST", True)])]
    [None, 'PRE', 'PRE']
    >>> {c.baseline for c in comparisons("PRE", [("INTER", True), ("POST", True)])}
    {'PRE'}
    """
    found: list[Comparison] = []
    previous: str | None = None
    for name, has_reference in measured:
        found.append(Comparison(named or first, previous))
        if has_reference:
            previous = name
    return tuple(found)


def require_baseline(baseline: str, reference: str, poses: Mapping[str, Pose] | None) -> None:
    """Check that the baseline stage has what every spine of the surgery needs of it.

    Parameters
    ----------
    baseline
        Name of the baseline stage.
    reference
        Vertebra of the reference triad.
    poses
        Labelled poses of its triads; None while the stage has no result.

    Raises
    ------
    BaselineMissingError
        If the stage has no result.
    ReferenceMissingError
        If it has no pose of the reference triad.
    """
    named = "name the stage that the initial configuration belongs to as the baseline in the setup"
    if poses is None:
        raise BaselineMissingError(
            f"the baseline stage {baseline} has no result; wait until its job has succeeded, take it again, or {named}"
        )
    if reference not in poses:
        raise ReferenceMissingError(
            f"the reference triad {reference} has no pose in the baseline stage {baseline}; label it there, take that"
            f" stage again, name another reference_vertebra, or {named}"
        )
