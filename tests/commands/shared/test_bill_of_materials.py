import re
from dataclasses import replace

import pytest

from commands.shared.anomalies import ANOMALIES
from commands.shared.bill_of_materials import bill_of_materials
from commands.shared.installed import Package, packages
from tests.paths import PROJECT
from tests.store.builders import NOON, at

LOCK = "".join(
    (PROJECT / name).read_text(encoding="utf-8") for name in ("requirements.lock", "requirements-dev.lock")
)


@pytest.fixture(scope="module")
def found() -> list[Package]:
    return packages(LOCK)


def test_every_reference_leads_to_a_component(found: list[Package]) -> None:
    bill = bill_of_materials(found, NOON)
    root = bill["metadata"]["component"]["bom-ref"]
    known = [root, *(component["bom-ref"] for component in bill["components"])]
    assert len(known) == len(set(known))
    assert {entry["ref"] for entry in bill["dependencies"]} == set(known)
    for entry in bill["dependencies"]:
        assert set(entry["dependsOn"]) <= set(known)
    for anomaly in bill["vulnerabilities"]:
        assert {affected["ref"] for affected in anomaly["affects"]} <= set(known)
    reached, waiting = set(), [root]
    edges = {entry["ref"]: entry["dependsOn"] for entry in bill["dependencies"]}
    while waiting:
        reference = waiting.pop()
        if reference not in reached:
            reached.add(reference)
            waiting += edges[reference]
    assert reached == set(known)


def test_components_have_version_licence_and_hashes(found: list[Package]) -> None:
    bill = bill_of_materials(found, NOON)
    for component in bill["components"]:
        assert re.fullmatch(r"pkg:(pypi|generic)/[a-z0-9.-]+@\S+", component["purl"])
        assert component["version"]
        assert component["licenses"]
        if component["purl"].startswith("pkg:pypi/"):
            (files,) = [r for r in component["externalReferences"] if r["type"] == "distribution"]
            assert all(re.fullmatch("[0-9a-f]{64}", entry["content"]) for entry in files["hashes"])
    names = {component["name"] for component in bill["components"]}
    assert {"python", "sqlite", "openssl", "libpq"} <= names


def test_the_serial_number_is_that_of_the_installation(found: list[Package]) -> None:
    first, later = bill_of_materials(found, NOON), bill_of_materials(found, at(60))
    assert first["serialNumber"] == later["serialNumber"]
    assert first["metadata"]["timestamp"] != later["metadata"]["timestamp"]
    other = [replace(package, version="0") if package.name == "numpy" else package for package in found]
    assert bill_of_materials(other, NOON)["serialNumber"] != first["serialNumber"]


def test_an_anomaly_of_another_version_is_in_triage(found: list[Package]) -> None:
    bill = bill_of_materials(found, NOON)
    assert len(bill["vulnerabilities"]) == len(ANOMALIES)
    assert {entry["analysis"]["state"] for entry in bill["vulnerabilities"]} == {"not_affected"}
    other = [replace(package, version="0") if package.name == "huey" else package for package in found]
    states = {
        entry["id"]: entry["analysis"]["state"] for entry in bill_of_materials(other, NOON)["vulnerabilities"]
    }
    assert {name for name, state in states.items() if state == "in_triage"} == {
        anomaly.identifier for anomaly in ANOMALIES if anomaly.package == "huey"
    }
