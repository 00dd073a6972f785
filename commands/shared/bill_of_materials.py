"""The software bill of materials as CycloneDX 1.6, from what is installed; nothing is looked up outside the machine."""

from __future__ import annotations

import json
import platform
import sqlite3
import ssl
from collections.abc import Sequence
from datetime import datetime
from typing import Any
from uuid import NAMESPACE_URL, uuid5

from commands.shared.anomalies import ANOMALIES, Anomaly
from commands.shared.installed import ROOT, UNKNOWN, Package

_SPEC = "1.6"


def bill_of_materials(packages: Sequence[Package], now: datetime) -> dict[str, Any]:
    """Return the CycloneDX document; the same installation gives the same serial number."""
    installed = {package.name: package for package in packages}
    root = installed[ROOT]
    runtime = runtime_components()
    components = [_component(package) for package in packages if package is not root] + runtime
    references = {package.name: _reference(package) for package in packages}
    dependencies = [
        {
            "ref": references[package.name],
            "dependsOn": sorted(
                [references[name] for name in package.requires if name in references]
                + ([component["bom-ref"] for component in runtime] if package is root else [])
            ),
        }
        for package in packages
    ]
    content: dict[str, Any] = {
        "components": components,
        "dependencies": dependencies + [{"ref": c["bom-ref"], "dependsOn": []} for c in runtime],
        "vulnerabilities": [
            _vulnerability(anomaly, installed[anomaly.package])
            for anomaly in ANOMALIES
            if anomaly.package in installed
        ],
    }
    serial = uuid5(NAMESPACE_URL, json.dumps(content, sort_keys=True))
    return {
        "$schema": f"http://cyclonedx.org/schema/bom-{_SPEC}.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": _SPEC,
        "serialNumber": f"urn:uuid:{serial}",
        "version": 1,
        "metadata": {
            "timestamp": now.isoformat(timespec="seconds"),
            "tools": {
                "components": [{"type": "application", "name": "spinewatch sbom", "version": root.version}]
            },
            "component": {**_component(root), "type": "application"},
        },
        **content,
    }


def runtime_components() -> list[dict[str, Any]]:
    """Return what is not a Python distribution: Python, and libraries that it and the database driver load."""
    from psycopg import pq  # noqa: PLC0415 - loads the library

    openssl = ssl.OPENSSL_VERSION.split()[1]
    number = pq.version()
    libpq = f"{number // 10000}.{number % 10000}"
    found = (
        ("application", "python", platform.python_version(), "PSF-2.0", "Python Software Foundation"),
        ("library", "sqlite", sqlite3.sqlite_version, "blessing", "D. Richard Hipp"),
        ("library", "openssl", openssl, "Apache-2.0", "OpenSSL Software Foundation"),
        ("library", "libpq", libpq, "PostgreSQL", "PostgreSQL Global Development Group"),
    )
    return [
        {
            "type": kind,
            "bom-ref": f"pkg:generic/{name}@{version}",
            "name": name,
            "version": version,
            "purl": f"pkg:generic/{name}@{version}",
            "supplier": {"name": maker},
            "licenses": [{"license": {"id": licence}}],
        }
        for kind, name, version, licence, maker in found
    ]


def _reference(package: Package) -> str:
    return f"pkg:pypi/{package.name}@{package.version.replace('+', '%2B')}"


def _component(package: Package) -> dict[str, Any]:
    component: dict[str, Any] = {
        "type": "library",
        "bom-ref": _reference(package),
        "name": package.name,
        "version": package.version,
        "purl": _reference(package),
        "scope": "optional" if package.optional else "required",
    }
    if package.maker != UNKNOWN:
        component["supplier"] = {"name": package.maker}
    if package.summary:
        component["description"] = package.summary
    if package.is_expression:
        component["licenses"] = [{"expression": package.licence}]
    elif package.licence != UNKNOWN:
        component["licenses"] = [{"license": {"name": package.licence}}]
    references: list[dict[str, Any]] = []
    if package.homepage:
        references.append({"type": "website", "url": package.homepage})
    if package.hashes:  # of the files that may be installed: one per platform
        hashes = [{"alg": "SHA-256", "content": value} for value in package.hashes]
        references.append({"type": "distribution", "url": component["purl"], "hashes": hashes})
    if references:
        component["externalReferences"] = references
    return component


def _vulnerability(anomaly: Anomaly, package: Package) -> dict[str, Any]:
    """Return a known anomaly; one that was examined with another version is in triage."""
    examined = package.version == anomaly.version
    return {
        "bom-ref": anomaly.identifier,
        "id": anomaly.identifier,
        "source": {"name": "docs/anomalies.md"},
        "description": f"{anomaly.behaviour} {anomaly.effect}",
        "analysis": {
            "state": "not_affected" if examined else "in_triage",
            **({"justification": "protected_by_mitigating_control"} if examined else {}),
            "detail": f"{anomaly.measure} Shown by {anomaly.test}. Examined with version {anomaly.version}.",
        },
        "affects": [{"ref": _reference(package)}],
    }
