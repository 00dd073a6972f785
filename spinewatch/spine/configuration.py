"""The configuration of a spine at one stage: poses of the vertebrae with their errors; result types, NumPy only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from spinewatch.arrays import Float


class Origin(StrEnum):
    """Where the pose of a vertebra comes from; the later ones take precedence."""

    MEASURED = "measured"
    INTERPOLATED = "interpolated"
    ASSUMED = "assumed"
    NOT_MEASURED = "not_measured"


class InitialKind(StrEnum):
    """How the initial configuration of a spine became known."""

    POSES = "poses"
    RADIOGRAPHS = "radiographs"
    GENERIC = "generic"


ErrorFactors = Mapping[str, Float]
"""Errors of the poses of n vertebrae by independent source: arrays of shape (n, 6, r), one column per unit error of
the source. Rows are those of `Pose.covariance`: position (mm), then a small rotation vector about the frame's axes
(degrees). Sources of the same name in two configurations are the same errors."""


@dataclass(frozen=True, eq=False)
class SpinePoses:
    """Poses of vertebrae as arrays.

    Attributes
    ----------
    position_mm
        Centroids of the bodies, shape (n, 3), patient axes, mm; NaN where there is no pose.
    rotation
        Rotations from vertebra to patient axes, shape (n, 3, 3); columns x anterior, y left, z cephalad; NaN where
        there is no pose.
    """

    position_mm: Float
    rotation: Float


@dataclass(frozen=True, eq=False)
class SpineConfiguration:
    """The spine at one stage, in patient axes that are fixed to the reference vertebra as of the baseline stage.

    Attributes
    ----------
    levels
        Names of the vertebrae from cranial to caudal.
    marked
        Which of them carry a triad that this stage and its baseline have a pose of, shape (n,), bool.
    origins
        Where each pose comes from.
    reasons
        Why a vertebra has no pose, or None.
    poses
        The poses.
    errors
        Their errors by independent source. Sources: ``initial`` (the initial configuration), ``patient axes`` (their
        directions), ``triads NAME`` (the poses of the triads at stage NAME), ``interpolation NAME`` (what interpolation
        at stage NAME cannot know).
    alternatives
        Other interpolations of the same data, which bracket the poses of vertebrae without a marker; equal to ``poses``
        for the others.
    assumed
        Whether the initial configuration is a generic spine, so that everything derived from it is assumed.
    reference
        Vertebra of the reference triad, whose centroid at the baseline is the origin of the frame; None if that is not
        known.
    """

    levels: tuple[str, ...]
    marked: tuple[bool, ...]
    origins: tuple[Origin, ...]
    reasons: tuple[str | None, ...]
    poses: SpinePoses
    errors: ErrorFactors
    alternatives: tuple[SpinePoses, ...] = ()
    assumed: bool = False
    reference: str | None = None

    @property
    def origin(self) -> str | None:
        """The vertebra whose centroid is the origin: the reference, where the initial configuration has it; or None."""
        if self.reference is None or self.reference not in self.levels:
            return None
        known = self.origins[self.index(self.reference)] in {Origin.MEASURED, Origin.ASSUMED}
        return self.reference if known else None

    def covariances(self) -> Float:
        """Return the covariance of each pose in the frame of the spine, whose origin has errors of its own.

        Returns
        -------
        Float
            Shape (n, 6, 6), mm and degrees, as of `Pose.covariance`; NaN where there is no pose. Positions are counted
            from the `origin`, whose errors are subtracted source by source: its own position has none.
        """
        total = np.zeros((len(self.levels), 6, 6))
        origin = None if self.origin is None else self.index(self.origin)
        for factor in self.errors.values():
            own = factor.copy()
            if origin is not None:
                own[:, :3] -= factor[origin, :3]
            total += own @ np.swapaxes(own, -1, -2)
        total[np.isnan(self.poses.position_mm).any(axis=1)] = np.nan
        return total

    def index(self, level: str) -> int:
        """Return the place of a vertebra.

        Parameters
        ----------
        level
            Its name.

        Returns
        -------
        int
            Its index in ``levels``.
        """
        return self.levels.index(level)


@dataclass(frozen=True, eq=False)
class InitialSpine:
    """The initial configuration: the poses of vertebrae at the baseline stage, in its object space.

    Attributes
    ----------
    kind
        How it became known.
    levels
        Names of the vertebrae from cranial to caudal.
    position_mm
        Centroids, shape (n, 3), object space of the baseline stage, mm.
    rotation
        Rotations from vertebra to object axes, shape (n, 3, 3).
    errors
        Errors of all poses together, shape (n, 6, r): columns are independent, rows as of `Pose.covariance`, object
        axes.
    by_axes
        How they change with a small rotation of the patient axes about themselves, because they were given in those
        axes: shape (n, 6, 3), object axes, mm and degrees per degree; None where they do not.
    """

    kind: InitialKind
    levels: tuple[str, ...]
    position_mm: Float
    rotation: Float
    errors: Float
    by_axes: Float | None = None


@dataclass(frozen=True)
class Rebaseline:
    """A marker that was clamped again while its vertebra did not move.

    Attributes
    ----------
    vertebra
        The vertebra.
    before
        Last stage with the marker in its former place.
    after
        First stage with it in its new place; the spine did not move between the two.
    """

    vertebra: str
    before: str
    after: str

    def within(self, order: Sequence[str], one: str, other: str) -> bool:
        """Return whether both stages lie between two others or are these.

        Parameters
        ----------
        order
            Names of the stages, in the order of the surgery.
        one, other
            Names of two stages, in any order.

        Returns
        -------
        bool
            Whether a marker's motion from one to the other is chained across.
        """
        first, last = sorted((order.index(one), order.index(other)))
        return first <= order.index(self.before) and order.index(self.after) <= last

    def overlaps(self, order: Sequence[str], one: str, other: str) -> bool:
        """Return whether the marker was elsewhere for a part of the time between two stages.

        Parameters
        ----------
        order
            Names of the stages, in the order of the surgery.
        one, other
            Names of two stages, in any order.

        Returns
        -------
        bool
            Whether the marker says nothing of the motion from one to the other.
        """
        first, last = sorted((order.index(one), order.index(other)))
        return first < order.index(self.after) and order.index(self.before) < last


@dataclass(frozen=True, eq=False)
class SpineSetup:
    """What must be known of a surgery to interpret its triads as a spine.

    Attributes
    ----------
    patient_axes
        Rotation from patient axes to object axes of the baseline stage, shape (3, 3); columns are the anterior, left
        and cephalad directions.
    reference
        Vertebra of the reference triad.
    baseline
        Name of the baseline stage.
    initial
        The initial configuration.
    rebaselines
        Markers that were clamped again, in the order of the stages.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones: T13, L6, or S2 to S5.
    axes_covariance_deg2
        Covariance of a small rotation of the patient axes about themselves, shape (3, 3), degrees^2, as of
        `axes_errors.direction_axes_covariance`; zero for exact axes.
    """

    patient_axes: Float
    reference: str
    baseline: str
    initial: InitialSpine
    rebaselines: Sequence[Rebaseline] = field(default_factory=tuple)
    extra_levels: Sequence[str] = ()
    axes_covariance_deg2: Float = field(default_factory=lambda: np.zeros((3, 3)))
