import socket

import pytest

from commands.shared.address import PortTakenError, require_free_port


def test_a_port_in_use_is_named() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(PortTakenError, match=f"127.0.0.1 port {port}: .*--port"):
            require_free_port("127.0.0.1", port)
    require_free_port("127.0.0.1", port)


@pytest.mark.parametrize("host", ["203.0.113.7", "no-such-host.invalid"])
def test_an_address_of_another_machine_is_named(host: str) -> None:
    with pytest.raises(PortTakenError, match="cannot listen on"):
        require_free_port(host, 8000)


@pytest.mark.parametrize("host", ["a" * 300, "a\n\u2028", "\udcff", "a..b"])
def test_what_is_no_address_is_named(host: str) -> None:
    with pytest.raises(PortTakenError, match=r"--host|cannot listen on"):
        require_free_port(host, 8000)
