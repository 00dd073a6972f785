"""The evaluation of networks by ONNX Runtime, beside one in NumPy that follows the definition of a layer."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.typing import NDArray

from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.network_graph import Layer, NetworkGraph
from spinewatch.detection.refinement.networks import BallNetwork

Singles = NDArray[np.float32]
LIGHT = Lighting.measured(np.array([0.2, -0.1]), 4.5).inputs
NETWORKS = (default_networks().proposal, *default_networks().refinement)


def patches(network: BallNetwork, count: int) -> Singles:
    size = network.grid.size
    return (
        np.random.default_rng(count)
        .normal(0, 1, (count, 1 + network.sees_others, size, size))
        .astype(np.float32)
    )


def in_numpy(network: BallNetwork, x: Singles, light: Singles) -> Singles:
    """Return the outputs (n, k) of patches (n, channels in, h, w), by direct sums."""
    x = x.transpose(0, 2, 3, 1)
    for layer in network.layers:
        windows = np.lib.stride_tricks.sliding_window_view(x, layer.weights.shape[:2], axis=(1, 2))
        windows = windows[:, :: layer.stride, :: layer.stride]
        x = np.einsum("nvucij,ijco->nvuo", windows, layer.weights, optimize=True) + layer.bias
        if layer.lighting is not None:
            x += light @ layer.lighting
        if layer is not network.layers[-1]:
            x = np.maximum(x, 0)
    return x[:, 0, 0]


@pytest.mark.parametrize("network", NETWORKS, ids=["proposal", "all looks", "large", "usual looks"])
@pytest.mark.parametrize("count", [1, 24, 250])
def test_the_outputs_are_those_of_the_definition(network: BallNetwork, count: int) -> None:
    x = patches(network, count)
    assert network.graph(x, LIGHT) == pytest.approx(in_numpy(network, x, LIGHT), abs=2e-5)


def test_the_light_is_an_input() -> None:
    x = patches(NETWORKS[1], 5)
    assert not np.allclose(NETWORKS[1].graph(x, LIGHT), NETWORKS[1].graph(x, -LIGHT), atol=1e-3)


def test_no_patches_have_no_outputs() -> None:
    assert NETWORKS[0].graph(patches(NETWORKS[0], 0), LIGHT).shape == (0, 11)


def test_rotated_patches_need_not_be_contiguous() -> None:
    x = patches(NETWORKS[1], 3)[..., ::-1, ::-1]
    assert np.array_equal(NETWORKS[1].graph(x, LIGHT), NETWORKS[1].graph(x.copy(), LIGHT))


def test_a_layer_of_one_channel_with_a_stride() -> None:
    layer = Layer(np.ones((2, 2, 1, 1), np.float32), np.zeros(1, np.float32), 2)
    last = Layer(np.ones((2, 2, 1, 1), np.float32), np.array([0.5], np.float32), 1)
    x = np.arange(16, dtype=np.float32).reshape(1, 1, 4, 4)
    assert NetworkGraph([layer, last], 4)(x, LIGHT).item() == x.sum() + 0.5


def test_equal_calls_give_equal_bits_also_at_the_same_time_and_from_another_session() -> None:
    network = NETWORKS[1]
    x = patches(network, 60)
    first = network.graph(x, LIGHT)
    other = NetworkGraph(network.layers, network.grid.size)
    with ThreadPoolExecutor(max_workers=4) as pool:
        again = list(pool.map(lambda k: (network.graph, other)[k % 2](x, LIGHT), range(40)))
    assert all(np.array_equal(outputs, first) for outputs in again)


def test_networks_have_no_threads_and_work_in_a_forked_process() -> None:
    """Workers load networks in a process that forks the processes of jobs: only one without threads can be forked.

    A release of ONNX Runtime that reports its use to its maker has a thread from its import on.
    """
    code = """
import os
import numpy as np
from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.network_file import default_networks
network, light = default_networks().proposal, np.zeros(7, np.float32)
x = np.linspace(-1, 1, 625, dtype=np.float32).reshape(1, 1, 25, 25)
here = network.graph(x, light)
assert len(os.listdir("/proc/self/task")) == 1, "a thread"
child = os.fork()
if child == 0:
    os._exit(0 if np.array_equal(network.graph(x, light), here) else 1)
assert os.waitpid(child, 0)[1] == 0, "another result in the forked process"
"""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    ended = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "", "")
