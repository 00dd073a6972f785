from service.openapi_access import declare_access
from service.scopes import SCOPES


def test_each_operation_names_what_it_needs() -> None:
    paths: dict[str, dict[str, dict[str, object]]] = {}
    for name in SCOPES:
        method, _, path = name.partition(" ")
        paths.setdefault(path, {})[method.lower()] = {"responses": {}}
    document = {"paths": paths}
    declare_access(document)
    security = {name: paths[name.split()[1]][name.split()[0].lower()]["security"] for name in SCOPES}
    assert security["GET /v1/surgeries"] == [{"key": ["stage:read"]}, {"session": ["stage:read"]}]
    assert security["GET /v1/jobs/{job_id}"] == [
        {scheme: [scope]} for scheme in ("key", "session") for scope in ("capture:write", "stage:read")
    ]
    assert security["GET /v1/session"] == [{"key": []}, {"session": []}]
    assert security["POST /v1/session"] == [{"key": []}]
    assert security["GET /health/live"] == []
    assert set(document["components"]["securitySchemes"]) == {"key", "session"}
