"""The committed contract, and the pages that show it."""

import ast
import json
import re

from service.app import create_app
from service.openapi import CONTRACT, text
from settings import Settings
from tests.http.harness import Service
from tests.paths import PROJECT


def test_the_committed_contract_is_current() -> None:
    assert CONTRACT.read_text() == text(create_app(Settings())), "run: python -m service.openapi"


NOT_OVER_HTTP = {"conflict", "dashboard-missing", "invalid-queue-url", "backup", "export-file", "audit-file"}
"""Codes of base classes, and of errors that only commands raise."""


def test_every_operation_has_a_plain_name_and_its_problems() -> None:
    document = json.loads(CONTRACT.read_text())
    assert document["openapi"].startswith("3.1")
    operations = [operation for path in document["paths"].values() for operation in path.values()]
    names = [operation["operationId"] for operation in operations]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)+", name) for name in names)
    for operation in operations:
        errors = {code: answer for code, answer in operation["responses"].items() if code >= "4"}
        assert {"500", "503"} <= set(errors)
        for answer in errors.values():
            schema = answer["content"]["application/problem+json"]["schema"]
            assert schema["$ref"].removeprefix("#/components/schemas/") in {"Problem", "NotReady"}
    assert "HTTPValidationError" not in document["components"]["schemas"]


def test_the_api_page_needs_nothing_from_outside(service: Service) -> None:
    page = service.client.get("/docs").text
    sources = re.findall(r"(?:src|href)=\"([^\"]+)\"", page)
    assert sources
    for source in sources:
        assert source.startswith("/docs/assets/")
        assert service.client.get(source).status_code == 200
    assert "http:" not in page
    assert "https:" not in page
    assert service.client.get("/openapi.json").json() == json.loads(CONTRACT.read_text())


def test_every_code_of_a_problem_is_in_the_manual() -> None:
    project = PROJECT
    manual = (project / "docs" / "api.md").read_text()
    nodes = [
        node
        for path in [*(project / "service").rglob("*.py"), *(project / "store").rglob("*.py")]
        for node in ast.walk(ast.parse(path.read_text()))
    ]
    codes = {
        str(node.value.value)
        for node in nodes
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Constant)
        and [target.id for target in node.targets if isinstance(target, ast.Name)] == ["code"]
    }
    assert {"stage-exists", "same-stage-twice"} <= codes
    assert [code for code in codes - NOT_OVER_HTTP if f"`{code}`" not in manual] == []


def test_every_field_and_parameter_has_a_description() -> None:
    document = json.loads(CONTRACT.read_text())
    fields = [
        (schema, name)
        for schema, content in document["components"]["schemas"].items()
        for name, entry in content.get("properties", {}).items()
        if "description" not in entry
    ]
    parameters = [
        (path, parameter["name"])
        for path, operations in document["paths"].items()
        for operation in operations.values()
        for parameter in operation.get("parameters", ())
        if "description" not in {*parameter, *parameter["schema"]}
    ]
    assert fields + parameters == []
