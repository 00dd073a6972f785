from pathlib import Path

import pytest

from commands.shared.exposure import (
    CertificateError,
    ExposureError,
    base_url,
    is_loopback,
    require_safe_exposure,
)
from settings import Settings


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.9.1", "::1", "[::1]", "localhost", "LOCALHOST"])
def test_this_machine_needs_no_tls(host: str) -> None:
    assert is_loopback(host)
    require_safe_exposure(Settings(host=host))


@pytest.mark.parametrize(
    "host",
    [
        "0.0.0.0",  # noqa: S104
        "::",
        "192.168.1.4",
        "10.0.0.1",
        "cart",
        "localhost.example",
        "127.0.0.1.example",
        "",
        "1270.0.1",
    ],
)
def test_anything_else_is_a_network(host: str) -> None:
    assert not is_loopback(host)
    with pytest.raises(ExposureError, match="--behind-proxy"):
        require_safe_exposure(Settings(host=host))
    require_safe_exposure(Settings(host=host, behind_proxy=True))


def test_a_certificate_and_its_key_come_together(tmp_path: Path) -> None:
    file = tmp_path / "file.pem"
    with pytest.raises(CertificateError, match="both"):
        require_safe_exposure(Settings(tls_key=file))
    with pytest.raises(CertificateError, match=f"cannot read {file}"):
        require_safe_exposure(Settings(tls_cert=file, tls_key=file))
    file.write_text("-----BEGIN CERTIFICATE-----")
    with pytest.raises(CertificateError, match="belong together"):
        require_safe_exposure(Settings(tls_cert=file, tls_key=file))


@pytest.mark.parametrize(
    ("settings", "url"),
    [
        (Settings(port=9000), "http://127.0.0.1:9000"),
        (Settings(host="0.0.0.0"), "http://127.0.0.1:8000"),  # noqa: S104
        (Settings(host="::"), "http://[::1]:8000"),
        (Settings(host="::1", tls_cert=Path("c"), tls_key=Path("k")), "https://[::1]:8000"),
    ],
)
def test_the_url_of_a_service(settings: Settings, url: str) -> None:
    assert base_url(settings) == url
