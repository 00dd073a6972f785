"""What the networks are given of a view's light: the lamp's direction, and where the shadows of the balls lie.

Light from the right also shades a ball's left side, and where an outline is faint a shadow beside the ball looks like a
part of it. The lamp's direction is measured (`spinewatch.detection.refinement.lamp`). The height of the balls over the
tissue is assumed: a patch does not show it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float, Single

N_INPUTS = 7
"""Number of inputs besides the patch."""
MIDDLE_LOG_HEIGHT = 2.0
"""Logarithm of the height, in radii, whose input is 0."""
_MAX_SHADOW = 4.0
"""Greatest displacement of a shadow, radii; the patches end at 2.5."""


_MIRRORED_BY_U, _MIRRORED_BY_V = (0, 4), (1, 5)
"""Inputs that change their sign when a patch is mirrored along u, and along v."""


@dataclass(frozen=True, eq=False)
class Lighting:
    """The light of a view, or of each of n patches.

    Attributes
    ----------
    inputs
        Inputs of the networks as `lighting_inputs` returns them, shape (7,) or (n, 7).
    """

    inputs: Single

    @classmethod
    def expected(cls, lamp: Float) -> Lighting:
        """Return the light of a view of which nothing is measured.

        Parameters
        ----------
        lamp
            Expected direction of the lamp, (u, v) part of the unit vector from the balls to the lamp, shape (2,).

        Returns
        -------
        Lighting
            The light.
        """
        no = np.zeros(1, dtype=bool)
        return cls(lighting_inputs(lamp[None], no, np.zeros(1), no)[0])

    @classmethod
    def measured(cls, lamp: Float, height: float) -> Lighting:
        """Return the light of a view whose lamp is measured.

        Parameters
        ----------
        lamp
            Measured direction of the lamp, shape (2,).
        height
            Height of the balls' centres over the tissue, radii.

        Returns
        -------
        Lighting
            The light.
        """
        yes = np.ones(1, dtype=bool)
        return cls(lighting_inputs(lamp[None], yes, np.log([height]), yes)[0])

    def turned(self, turn: tuple[int, int]) -> Lighting:
        """Return the light of the mirrored or rotated view.

        Parameters
        ----------
        turn
            Signs of u and of v.

        Returns
        -------
        Lighting
            The light.
        """
        inputs = self.inputs.copy()
        inputs[..., [_MIRRORED_BY_U, _MIRRORED_BY_V]] *= np.array(turn, dtype=np.float32)[:, None]
        return Lighting(inputs)


def lighting_inputs(
    lamp: Float, lamp_is_measured: Bool, log_height: Float, height_is_measured: Bool
) -> Single:
    """Return the inputs of the networks for n examples of light.

    Parameters
    ----------
    lamp
        Lamp directions, shape (n, 2).
    lamp_is_measured
        Whether they are measured, shape (n,).
    log_height
        Logarithms of the heights, in radii, shape (n,).
    height_is_measured
        Whether these are measured, shape (n,); where not, they have no influence.

    Returns
    -------
    Single
        Per example the lamp direction, 1 if it is measured, the logarithm of the height, the displacement (u, v) of the
        shadow on level tissue, and 1 if the height is measured, shape (n, 7).

    Examples
    --------
    >>> yes = np.array([True])
    >>> lighting_inputs(np.array([[0.6, 0.0]]), yes, np.log([2.0]), yes).round(2) + 0
    array([[ 0.6 ,  0.  ,  1.  , -1.31, -1.5 ,  0.  ,  1.  ]], dtype=float32)
    """
    cosine = np.sqrt((1 - np.square(lamp).sum(axis=1)).clip(1e-3))
    shadow = (-np.exp(log_height) / cosine)[:, None] * lamp
    length = np.linalg.norm(shadow, axis=1).clip(1e-6)
    shadow *= (np.minimum(length, _MAX_SHADOW) / length)[:, None]
    height = np.column_stack([log_height - MIDDLE_LOG_HEIGHT, shadow, np.ones(len(lamp))])
    inputs = np.column_stack([lamp, lamp_is_measured, height * height_is_measured[:, None]])
    return np.asarray(inputs, dtype=np.float32)
