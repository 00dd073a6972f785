"""Files of ball networks."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinewatch.array_file import reading_arrays, write_arrays
from spinewatch.arrays import Single
from spinewatch.detection.refinement.network_graph import Layer
from spinewatch.detection.refinement.networks import BallNetwork, BallNetworks
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.errors import NetworkFileError

_PARTS = ("weights", "bias", "lighting")


def write_networks(networks: BallNetworks) -> bytes:
    """Return networks as the contents of a file.

    Parameters
    ----------
    networks
        The networks.

    Returns
    -------
    bytes
        Contents of an npz file, the proposal network first, weights at half precision.
    """
    every = (networks.proposal, *networks.refinement)
    description = [
        {
            "size": network.grid.size,
            "radius": network.grid.radius,
            "from_px": network.min_width_px,
            "strides": [layer.stride for layer in network.layers],
        }
        for network in every
    ]
    arrays = {
        f"{i}_{j}_{part}": getattr(layer, part).astype(np.float16)
        for i, network in enumerate(every)
        for j, layer in enumerate(network.layers)
        for part in _PARTS
        if getattr(layer, part) is not None
    }
    return write_arrays(description, arrays)


def read_networks(data: bytes) -> BallNetworks:
    """Return the networks of a file.

    Parameters
    ----------
    data
        Contents of a file written by `write_networks` or ``python -m training``.

    Returns
    -------
    BallNetworks
        The networks, weights at single precision.

    Raises
    ------
    NetworkFileError
        When the file holds no networks.

    Examples
    --------
    >>> networks = read_networks(write_networks(default_networks()))
    >>> networks.proposal.grid
    PatchGrid(size=25, radius=5.0)
    """
    error = NetworkFileError("the file holds no ball network; train one with `python -m training`")
    with reading_arrays(data, error) as (description, arrays):
        proposal, *refinement = (_network(arrays, i, entry) for i, entry in enumerate(description))
        return BallNetworks(proposal, tuple(refinement))


@cache
def default_networks() -> BallNetworks:
    """Return the networks that ship with the library.

    Returns
    -------
    BallNetworks
        Made by ``python -m training``; read once per process.
    """
    return read_networks(resources.files(__package__).joinpath("networks.npz").read_bytes())


def _network(arrays: Mapping[str, NDArray[Any]], i: int, entry: Mapping[str, Any]) -> BallNetwork:
    """Return the i-th network of a file."""

    def part(name: str) -> Single:
        return np.asarray(arrays[name], dtype=np.float32)

    layers = tuple(
        Layer(
            part(f"{i}_{j}_weights"),
            part(f"{i}_{j}_bias"),
            int(stride),
            part(f"{i}_{j}_lighting") if f"{i}_{j}_lighting" in arrays else None,
        )
        for j, stride in enumerate(entry["strides"])
    )
    grid = PatchGrid(int(entry["size"]), float(entry["radius"]))
    return BallNetwork(grid, float(entry["from_px"]), layers)
