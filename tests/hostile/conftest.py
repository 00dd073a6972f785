from collections.abc import Iterator

import pytest

from tests.hostile.attack import JSON
from tests.http.harness import Service


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service without workers, impatient with slow clients, that has answered each kind of request once."""
    with Service(
        tmp_path_factory.mktemp("hostile"),
        SPINEWATCH_HEADER_TIMEOUT_SECONDS="2",
        SPINEWATCH_BODY_TIMEOUT_SECONDS="2",
        SPINEWATCH_WRITE_TIMEOUT_SECONDS="2",
        SPINEWATCH_MAX_CONNECTIONS="400",
    ) as service:
        surgery = service.surgery()
        service.calibration()
        for _ in range(2):
            service.client.post(f"/v1/surgeries/{surgery}/stages", files={"left": ("l", b"x")})
            service.client.post("/v1/calibrations/from-images", files={"left": ("l", b"x")})
            service.client.post(f"/v1/surgeries/{surgery}/radiographs/fit", content=b"{}", headers=JSON)
            service.client.put(f"/v1/surgeries/{surgery}/spine", content=b"{}", headers=JSON)
            service.client.get("/v1/nothing")
        yield service


@pytest.fixture(scope="session")
def surgery(service: Service) -> str:
    return service.surgery()
