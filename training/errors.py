"""Errors of a fitted network on examples that it was not fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from spinewatch.arrays import Bool
from spinewatch.detection.refinement.networks import OUTPUTS, SCALES
from spinewatch.simulation.images.families import FAMILIES
from training.augmentation import BALL, VISIBLE, U
from training.losses import by_name, centre_chi2

REGION_95 = 5.99
"""Chi-square of two degrees of freedom that 95% of errors do not exceed, if they are normal."""


@dataclass(frozen=True)
class CentreErrors:
    """Errors of the centres of balls in full view, and how they compare with their stated covariances.

    Attributes
    ----------
    balls
        Number of balls.
    found
        Fraction that the network recognizes.
    median_radii
        Median absolute error per axis, radii.
    rms_radii
        RMS error per axis, radii.
    chi2_per_dof
        Mean chi-square per degree of freedom.
    within_95
        Fraction inside the 95% regions.
    """

    balls: int
    found: float
    median_radii: float
    rms_radii: float
    chi2_per_dof: float
    within_95: float

    def __str__(self) -> str:
        return (
            f"{self.balls:5} balls, found {self.found:6.1%}, median error {self.median_radii:.4f} radii, "
            f"RMS {self.rms_radii:.4f}, chi2 / dof {self.chi2_per_dof:.2f}, "
            f"in the 95% region {self.within_95:.1%}"
        )


@dataclass(frozen=True)
class FitErrors:
    """Errors of a network on the held-out examples.

    Attributes
    ----------
    classified
        Fraction of all held-out examples that are classified correctly, the lamp not measured.
    families
        Errors of all of them ("all") and of each family of looks that has any.
    """

    classified: float
    families: dict[str, CentreErrors]

    def __str__(self) -> str:
        lines = [
            f"held out, lamp not measured, other balls known: classified correctly {self.classified:.1%}"
        ]
        return "\n".join([*lines, *(f"  {name:13} {errors}" for name, errors in self.families.items())])


def fit_errors(outputs: Tensor, truth: Tensor, families: Bool) -> FitErrors:
    """Return the errors of a network on examples, and on each family of looks.

    Parameters
    ----------
    outputs
        Outputs of the network, shape (n, k).
    truth
        Truth, shape (n, 8).
    families
        Which examples are of which family, shape (n, f).

    Returns
    -------
    FitErrors
        The errors; those of centres are of balls in full view.
    """
    clear = (truth[:, BALL] > 0.5) & (truth[:, VISIBLE] > 0.9)
    correct = ((outputs[:, OUTPUTS.index("log_odds")] > 0) == (truth[:, BALL] > 0.5)).float().mean()
    masks = {"all": np.ones(len(truth), dtype=bool)} | dict(zip(FAMILIES, families.T, strict=True))
    chosen = {name: clear & torch.from_numpy(mask) for name, mask in masks.items()}
    return FitErrors(
        float(correct),
        {name: _centre_errors(outputs[mask], truth[mask]) for name, mask in chosen.items() if mask.any()},
    )


def _centre_errors(outputs: Tensor, truth: Tensor) -> CentreErrors:
    """Return the errors of the centres of n balls."""
    estimated = by_name(outputs)
    offset = torch.stack([estimated["u"], estimated["v"]], dim=1)
    error = (truth[:, U:VISIBLE] - SCALES.offset * offset).abs()
    chi2 = centre_chi2(estimated, truth) * (SCALES.dof - 2) / SCALES.dof
    return CentreErrors(
        len(truth),
        float((estimated["log_odds"] > 0).float().mean()),
        float(error.median()),
        float(error.square().mean().sqrt()),
        float(chi2.mean() / 2),
        float((chi2 < REGION_95).float().mean()),
    )
