"""Small convolutional networks that look at the patch about a feature and say whether and where a ball is.

They have learnt from simulated pictures alone (``training/``). They are told where the cart's lamp should hang as seen
from the camera, since a lamp that lights a ball from its right also shades its left. The weights are data,
``networks.npz``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from spinewatch.array_file import reading_arrays, write_arrays
from spinewatch.arrays import Float, Single
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.errors import BallNetError

_BLOCK = 256
"""Patches looked at together: few enough to take little memory, many enough that two threads seldom wait for each
other between NumPy's calls."""
_CONTRAST_FLOOR = np.float32(0.05)
"""Patches whose log gray levels vary by less than about this are noise or nothing, and stay faint."""


@dataclass(frozen=True, eq=False)
class Layer:
    """Weights (h, w, channels in, channels out) and bias (channels out,) of a convolution without padding.

    ``lamp`` (3, channels out): what each component of the lamp's direction, and that it is known, adds to the bias.
    """

    weights: Single
    bias: Single
    stride: int
    lamp: Single | None = None


@dataclass(frozen=True, eq=False)
class BallNet:
    """A network for balls at least ``from_px`` wide, on patches of a grid.

    All layers but the last are rectified; the last one leaves a single place with the ``OUTPUTS``.
    """

    grid: PatchGrid
    from_px: float
    layers: tuple[Layer, ...]


@dataclass(frozen=True, eq=False)
class BallNets:
    """A small network, the ``scout``, which looks at many features quickly, and the ``judges`` by size of ball."""

    scout: BallNet
    judges: tuple[BallNet, ...]

    def judge(self, width_px: float) -> BallNet:
        """Return the judge made for balls of a width in pixels."""
        fit = [net for net in self.judges if net.from_px <= width_px]
        return max(fit, key=lambda net: net.from_px)


@dataclass(frozen=True, eq=False)
class BallEstimates:
    """What n patches show, in radii of the ball, u to the right and v down.

    ``log_odds`` (n,) of a ball in the middle; if so, ``offset`` (n, 2) of its outline's centre from the patch's middle
    with ``covariance`` (n, 2, 2), ``visible`` fraction (n,) of it, and ``log_size`` (n,), the logarithm of its size
    over the size that the patch was cut for; ``lamp`` (n, 2) and ``lamp_sd`` (n,), where the lamp hangs by this patch
    alone.
    """

    log_odds: Float
    offset: Float
    covariance: Float
    visible: Float
    log_size: Float
    lamp: Float
    lamp_sd: Float


OUTPUTS = (
    "log_odds",
    "u",
    "v",
    "log_u",
    "log_v",
    "tie",
    "visible",
    "log_size",
    "lamp_u",
    "lamp_v",
    "log_lamp",
)
UNITS = {"offset": 0.3, "log_precision": 3.0, "log_size": 0.1, "lamp": 0.3, "log_lamp": 2.0, "freedom": 8.0}
"""Scales of the outputs: offsets in 0.3 radii, logarithms of precisions about 3, sizes in tenths, and so on; and the
degrees of freedom of the t-distribution by which errors were weighed in training."""


def look(net: BallNet, patches: Single, lamp: Float, known: bool) -> BallEstimates:
    """Return what the patches (n, size, size) of log gray levels show.

    ``lamp`` (2,): the u and v components of the unit vector to where the lamp should hang or, if that is ``known``,
    does.
    """
    told = np.array([*lamp, known], dtype=np.float32)
    blocks = (patches[start : start + _BLOCK] for start in range(0, max(len(patches), 1), _BLOCK))
    out = np.concatenate([_run(net.layers, normalise(block)[..., None], told) for block in blocks]).astype(
        float
    )
    log_odds, u, v, log_u, log_v, tie, visible, log_size, lamp_u, lamp_v, log_lamp = out.T
    a, b = np.exp(-log_u - UNITS["log_precision"]), np.exp(-log_v - UNITS["log_precision"])
    covariance = np.empty((len(out), 2, 2))
    covariance[:, 0, 0], covariance[:, 1, 1] = (1 + tie**2) * a**2, b**2
    covariance[:, 0, 1] = covariance[:, 1, 0] = -tie * a * b
    return BallEstimates(
        log_odds,
        UNITS["offset"] * np.stack([u, v], axis=1),
        covariance * (UNITS["freedom"] / (UNITS["freedom"] - 2)),
        1 / (1 + np.exp(-visible)),
        UNITS["log_size"] * log_size,
        UNITS["lamp"] * np.stack([lamp_u, lamp_v], axis=1),
        np.exp(-log_lamp - UNITS["log_lamp"]),
    )


def normalise(patches: Single) -> Single:
    """Return patches (n, h, w) of mean 0 and variance 1, but for faint ones."""
    x = patches - patches.mean(axis=(1, 2), keepdims=True)
    spread = np.sqrt(np.einsum("nhw,nhw->n", x, x) / (x.shape[1] * x.shape[2]))
    x /= spread[:, None, None] + _CONTRAST_FLOOR
    return np.asarray(x)


def _run(layers: Sequence[Layer], x: Single, lamp: Single) -> Single:
    """Return the outputs (n, k) of patches (n, h, w, 1)."""
    for layer in layers:
        kh, kw, channels, out = layer.weights.shape
        n, h, w = len(x), *((m - k) // layer.stride + 1 for m, k in zip(x.shape[1:3], (kh, kw), strict=True))
        if h * w > 1:
            windows = np.lib.stride_tricks.sliding_window_view(x, (kh, kw), axis=(1, 2))
            x = windows[:, :: layer.stride, :: layer.stride].transpose(0, 1, 2, 4, 5, 3)
        flat = x.reshape(n * h * w, kh * kw * channels) @ layer.weights.reshape(-1, out)
        flat += layer.bias if layer.lamp is None else layer.bias + lamp @ layer.lamp
        if layer is not layers[-1]:
            np.maximum(flat, 0, out=flat)
        x = flat.reshape(n, h, w, out)
    return x[:, 0, 0]


def write_ball_nets(nets: BallNets) -> bytes:
    """Return the bytes of a file of networks, the scout first, weights at half precision."""
    every = (nets.scout, *nets.judges)
    about = [
        {
            "size": n.grid.size,
            "radius": n.grid.radius,
            "from_px": n.from_px,
            "strides": [x.stride for x in n.layers],
        }
        for n in every
    ]
    arrays = {
        f"{i}_{j}_{part}": getattr(layer, part).astype(np.float16)
        for i, net in enumerate(every)
        for j, layer in enumerate(net.layers)
        for part in ("weights", "bias", "lamp")
        if getattr(layer, part) is not None
    }
    return write_arrays(about, arrays)


def read_ball_nets(data: bytes) -> BallNets:
    """Return the networks of a file's bytes; raise ``BallNetError`` when it holds none."""
    none = BallNetError("the file holds no ball network; train one with `python -m training`")
    with reading_arrays(data, none) as (about, arrays):

        def part(name: str) -> Single:
            return np.asarray(arrays[name], dtype=np.float32)

        scout, *judges = (
            BallNet(
                PatchGrid(int(net["size"]), float(net["radius"])),
                float(net["from_px"]),
                tuple(
                    Layer(
                        part(f"{i}_{j}_weights"),
                        part(f"{i}_{j}_bias"),
                        int(stride),
                        part(f"{i}_{j}_lamp") if f"{i}_{j}_lamp" in arrays else None,
                    )
                    for j, stride in enumerate(net["strides"])
                ),
            )
            for i, net in enumerate(about)
        )
        return BallNets(scout, tuple(judges))


@cache
def default_ball_nets() -> BallNets:
    """Return the networks that ship with the library."""
    return read_ball_nets(resources.files(__package__).joinpath("networks.npz").read_bytes())
