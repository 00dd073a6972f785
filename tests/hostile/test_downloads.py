"""Many clients ask for the largest images and do not read them: what is not read is not in memory."""

import socket
from contextlib import ExitStack
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from tests.hostile.attack import PATIENCE_S, forget_peak, head, peak_memory
from tests.http.harness import RIG, Service
from tests.http.test_stages import encoded

CLIENTS = 80
SIZE_PX = 3000


def large_rig() -> dict[str, Any]:
    """Return a rig whose images are noise of 9 MB."""
    rig: dict[str, Any] = {"name": "large"}
    for side in ("left", "right"):
        width, height = RIG[side]["image_size_px"]
        px, py = RIG[side]["pixel_size_mm"]
        rig[side] = {
            **RIG[side],
            "image_size_px": [SIZE_PX, SIZE_PX],
            "pixel_size_mm": [px * width / SIZE_PX, py * height / SIZE_PX],
        }
    return rig


def test_images_that_are_not_read_are_not_in_memory(tmp_path: Path) -> None:
    random = np.random.default_rng(7)
    left, right = (encoded(random.integers(0, 256, (SIZE_PX, SIZE_PX), np.uint8), "PNG") for _ in range(2))
    with Service(tmp_path) as service, ExitStack() as opened:
        surgery = service.surgery()
        answer = service.send(surgery, "PRE", (left, right), service.calibration(large_rig()))
        assert answer.status_code == 202, answer.text
        path = f"/v1/surgeries/{surgery}/stages/PRE/images/left"
        received = service.client.get(path)
        assert sha256(received.content).hexdigest() == received.headers["ETag"].strip('"')
        assert int(received.headers["Content-Length"]) == len(received.content) > 8_000_000
        forget_peak(service.server.pid)
        before = peak_memory(service.server.pid)
        clients = [opened.enter_context(socket.socket()) for _ in range(CLIENTS)]
        for client in clients:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            client.settimeout(PATIENCE_S)
            client.connect(("127.0.0.1", service.port))
            client.sendall(head(service, f"GET {path} HTTP/1.1"))
        for client in clients:
            assert client.recv(12) == b"HTTP/1.1 200"
        # As many parts as there are threads are read at once, each with the cache of its connection.
        assert peak_memory(service.server.pid) - before < CLIENTS * len(received.content) / 2
