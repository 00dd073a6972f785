import numpy as np
import pytest

from spinewatch.detection.refinement.network_file import default_networks, read_networks, write_networks
from spinewatch.errors import NetworkFileError


def test_a_file_of_networks_is_read_as_it_was_written() -> None:
    networks = default_networks()
    data = write_networks(networks)
    again = read_networks(data)
    assert len(data) < 2_000_000
    before, after = ((n.proposal, *n.refinement) for n in (networks, again))
    for network, copy in zip(before, after, strict=True):
        assert (copy.grid, copy.min_width_px) == (network.grid, network.min_width_px)
        for layer, other in zip(network.layers, copy.layers, strict=True):
            assert np.array_equal(layer.weights, other.weights)
            assert (layer.lighting is None) == (other.lighting is None)


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"not a file of weights"])
def test_other_files_are_refused(data: bytes) -> None:
    with pytest.raises(NetworkFileError, match="no ball network"):
        read_networks(data)
