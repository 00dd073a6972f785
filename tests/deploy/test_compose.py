"""compose.yaml: what it starts is closed, limited, pinned, and fits the settings and commands that exist."""

import re
from ipaddress import ip_network
from typing import Any

import pytest
import typer

from commands.main import cli
from settings import Settings
from tests.deploy.dockerfile import instructions
from tests.paths import PROJECT

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")

TEXT = (PROJECT / "compose.yaml").read_text(encoding="utf-8")
DOCUMENT: dict[str, Any] = yaml.safe_load(TEXT)
SERVICES: dict[str, dict[str, Any]] = DOCUMENT["services"]
OWN = {name: service for name, service in SERVICES.items() if service["image"].startswith("spinewatch:")}
HEALTHY = {name for name, service in SERVICES.items() if "test" in service.get("healthcheck", {})}
IMAGE_HAS_HEALTH_CHECK = any(
    instruction.keyword == "HEALTHCHECK"
    for instruction in instructions((PROJECT / "Dockerfile").read_text(encoding="utf-8"))
)


def test_there_is_api_workers_database_queue_and_proxy() -> None:
    assert set(SERVICES) == {"proxy", "migrate", "api", "worker", "postgres", "redis"}


@pytest.mark.parametrize("name", SERVICES)
def test_a_container_can_do_little(name: str) -> None:
    service = SERVICES[name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert not service.get("privileged")
    assert any(place.startswith("/tmp") for place in service["tmpfs"])  # noqa: S108 - inside the container
    assert re.fullmatch(r"\d+[mg]", service["mem_limit"])
    assert service["logging"]["options"]["max-size"]
    assert service["restart"] in {"unless-stopped", "no"}


@pytest.mark.parametrize("name", SERVICES)
def test_images_have_a_version(name: str) -> None:
    assert re.fullmatch(r"[\w./-]+:[\w.-]*\d[\w.-]*", SERVICES[name]["image"])


def test_only_the_proxy_is_reached_from_outside() -> None:
    outside = {name for name, network in DOCUMENT["networks"].items() if not (network or {}).get("internal")}
    assert outside == {"outside"}
    for name, service in SERVICES.items():
        assert service.get("network_mode") is None
        if name == "proxy":
            assert [port.rpartition(":")[2] for port in service["ports"]] == ["443"]
        else:
            assert "ports" not in service
            assert not outside & set(service["networks"])
    assert not set(SERVICES["proxy"]["networks"]) & set(SERVICES["postgres"]["networks"])


def test_the_api_believes_the_proxy_and_no_one_else() -> None:
    trusted = SERVICES["api"]["environment"]["SPINEWATCH_TRUSTED_PROXIES"]
    (subnet,) = DOCUMENT["networks"]["edge"]["ipam"]["config"]
    assert ip_network(trusted) == ip_network(subnet["subnet"])
    assert {name for name, service in SERVICES.items() if "edge" in service["networks"]} == {"proxy", "api"}


def test_passwords_are_no_part_of_the_file_and_the_example_names_all_variables() -> None:
    used = dict(re.findall(r"\$\{(\w+)([^}]*)\}", TEXT))
    example = dict(
        line.split("=", 1)
        for line in (PROJECT / "deploy" / "example.env").read_text(encoding="utf-8").splitlines()
        if line and not line.startswith("#")
    )
    assert set(used) == set(example)
    for name, rest in used.items():
        assert rest.startswith(":?") if not example[name] else rest == f":-{example[name]}"
    values = {key: text for s in SERVICES.values() for key, text in s.get("environment", {}).items()}
    secrets = [text for key, text in values.items() if "PASSWORD" in key or key == "REDISCLI_AUTH"]
    assert secrets
    assert all(text.startswith("${") for text in secrets)
    assert all("${" in text for text in values.values() if "://" in text)
    assert (
        not (PROJECT / "deploy" / "certs").exists()
        or list((PROJECT / "deploy" / "certs").glob("*.pem")) == []
    )


@pytest.mark.parametrize("name", OWN)
def test_settings_and_commands_exist(name: str) -> None:
    fields = {f"SPINEWATCH_{field.upper()}" for field in Settings.model_fields}
    assert set(OWN[name]["environment"]) <= fields
    program, *words = OWN[name]["command"]
    assert program == "spinewatch"
    command: Any = typer.main.get_command(cli)
    while hasattr(command, "commands"):
        command = command.commands[words.pop(0)]
    command.make_context(name, words)  # raises for an option that does not exist


@pytest.mark.parametrize("name", OWN)
def test_what_must_be_there_first_is_waited_for(name: str) -> None:
    needed = OWN[name]["depends_on"]
    if name == "migrate":
        assert needed == {"postgres": {"condition": "service_healthy"}}
    else:
        assert needed["migrate"] == {"condition": "service_completed_successfully"}


def test_a_service_that_must_be_healthy_has_a_check() -> None:
    for service in SERVICES.values():
        for other, need in service.get("depends_on", {}).items():
            if need["condition"] == "service_healthy":
                assert other in HEALTHY or (IMAGE_HAS_HEALTH_CHECK and other in OWN)


def test_files_that_are_mounted_exist() -> None:
    volumes = [volume for service in SERVICES.values() for volume in service.get("volumes", ())]
    for source, _, rest in (volume.partition(":") for volume in volumes):
        if source.startswith("./deploy/certs"):
            assert rest.endswith(":ro")  # the operator's own
        elif source.startswith("."):
            assert (PROJECT / source).exists()
            assert rest.endswith(":ro")
        else:
            assert source in DOCUMENT["volumes"]


def test_a_worker_has_as_much_memory_as_its_jobs_may_take() -> None:
    gigabytes = int(SERVICES["worker"]["mem_limit"].removesuffix("g"))
    assert gigabytes * 1024**3 >= Settings.model_fields["worker_memory_bytes"].default + 512 * 1024**2
