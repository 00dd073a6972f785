"""Where the service may listen: beyond this machine only with TLS, its own or that of a proxy."""

from __future__ import annotations

import ipaddress
import ssl
from typing import TYPE_CHECKING

from spinewatch.errors import SpinewatchError
from store.regular_file import MAX_DOCUMENT_BYTES, read_regular

if TYPE_CHECKING:
    from pathlib import Path

    from settings import Settings


class ExposureError(SpinewatchError):
    """The service would listen on a network without TLS."""

    code = "no-tls"


class CertificateError(SpinewatchError):
    """The TLS certificate or its key cannot be used."""

    code = "invalid-certificate"


def is_loopback(host: str) -> bool:
    """Return whether only programs of this machine reach an address."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def require_safe_exposure(settings: Settings) -> None:
    """Raise ``ExposureError`` for an address on a network without TLS, ``CertificateError`` for useless TLS files."""
    if (settings.tls_cert is None) != (settings.tls_key is None):
        raise CertificateError("TLS needs a certificate and its key: give both --tls-cert and --tls-key")
    if settings.tls_cert is not None and settings.tls_key is not None:
        _require_certificate(settings.tls_cert, settings.tls_key)
    elif not is_loopback(settings.host) and not settings.behind_proxy:
        raise ExposureError(
            f"listening on {settings.host} would send keys and images over the network unencrypted; give --tls-cert and"
            " --tls-key, or --behind-proxy if a proxy ends TLS before this service"
        )


def base_url(settings: Settings) -> str:
    """Return the URL of a service as this machine reaches it."""
    scheme = "http" if settings.tls_cert is None else "https"
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(settings.host, settings.host)  # noqa: S104
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{settings.port}"


def _require_certificate(certificate: Path, key: Path) -> None:
    for file in (certificate, key):
        try:
            read_regular(file, MAX_DOCUMENT_BYTES)
        except OSError as error:
            raise CertificateError(
                f"cannot read {file}: {error.strerror}; check --tls-cert and --tls-key"
            ) from error
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(
            str(certificate), str(key), password=""
        )
    except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
        raise CertificateError(
            f"{certificate} and {key} are no certificate with its key: {error}; give PEM files that"
            " belong together, the key without a password"
        ) from error
