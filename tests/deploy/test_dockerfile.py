"""The Dockerfile: rules as of hadolint, and its steps carried out in a clean folder without Docker."""

import json
import os
import re
import shlex
import subprocess
import tomllib
from pathlib import Path

import pytest

from settings import Settings
from tests.deploy.dockerfile import (
    Instruction,
    allowed_by_dockerignore,
    anyone_may_run,
    base_python,
    instructions,
    placed,
    replay,
)
from tests.http.harness import free_port, wait_for
from tests.paths import PROJECT

ALL = instructions((PROJECT / "Dockerfile").read_text(encoding="utf-8"))
LAST = [instruction for instruction in ALL if instruction.stage == ALL[-1].stage]
BUILD = [instruction for instruction in ALL if instruction.stage == 0]


def of(keyword: str, among: list[Instruction] = ALL) -> list[str]:
    return [instruction.text for instruction in among if instruction.keyword == keyword]


def words(command: str) -> list[list[str]]:
    """Return the commands of a shell line, each as its words."""
    return [shlex.split(part) for part in re.split(r"&&|;|\|\|", command)]


def test_images_have_a_version_and_all_stages_the_same() -> None:
    images = [text.split()[0] for text in of("FROM")]
    assert len(set(images)) == 1
    assert re.fullmatch(r"[\w./-]+:[\w.-]*\d[\w.-]*", images[0])
    assert not images[0].endswith(":latest")


def test_only_files_of_the_project_come_in() -> None:
    assert of("ADD") == []
    for text in of("COPY"):
        if not text.startswith("--from="):
            *names, _ = text.split()
            assert all((PROJECT / name).exists() and allowed_by_dockerignore(name) for name in names), text


def test_every_package_is_copied() -> None:
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
    packages = {name.rstrip("*") for name in project["tool"]["setuptools"]["packages"]["find"]["include"]}
    copied = {text.split()[0] for text in of("COPY") if text.split()[1].startswith("/src/")}
    assert packages <= copied


def test_packages_are_installed_by_hash_or_without_dependencies() -> None:
    installs = [command for text in of("RUN") for command in words(text) if command[1:2] == ["install"]]
    pip = [command for command in installs if command[0].endswith("pip")]
    assert pip
    for command in pip:
        assert "--no-cache-dir" in command
        assert {"--require-hashes", "--no-deps"} & set(command)


def test_apt_leaves_nothing_behind_and_installs_what_is_named() -> None:
    for instruction in ALL:
        commands = words(instruction.text) if instruction.keyword == "RUN" else []
        if ["apt-get", "update"] not in commands:
            assert not any(command[0] == "apt-get" for command in commands)
            continue
        (install,) = [command for command in commands if command[:2] == ["apt-get", "install"]]
        assert {"-y", "--no-install-recommends"} <= set(install)
        assert ["rm", "-rf", "/var/lib/apt/lists/*"] in commands
        assert any("DL3008" in comment for comment in instruction.comments)


def test_shell_lines_have_no_pipe_and_no_sudo() -> None:
    for text in of("RUN"):
        assert "|" not in text.replace("||", "")
        assert not {"sudo", "curl", "wget", "cd"} & {command[0] for command in words(text)}


def test_it_runs_as_a_user_who_is_not_root() -> None:
    (user,) = of("USER", LAST)
    (made,) = [command for text in of("RUN", LAST) for command in words(text) if command[0] == "useradd"]
    assert user == made[-1] != "root"
    assert int(made[made.index("--uid") + 1]) >= 10000
    keywords = [instruction.keyword for instruction in LAST]
    assert keywords.index("USER") > max(n for n, keyword in enumerate(keywords) if keyword in {"RUN", "COPY"})


def test_places_are_absolute_and_commands_are_lists() -> None:
    assert all(text.startswith("/") for text in of("WORKDIR"))
    (command,) = of("CMD", LAST)
    assert isinstance(json.loads(command), list)
    assert of("STOPSIGNAL", LAST) == ["SIGTERM"]
    assert of("EXPOSE", LAST) == [str(Settings.model_fields["port"].default)]


def test_settings_of_the_image_exist() -> None:
    names = re.findall(r"SPINEWATCH_(\w+)=", " ".join(of("ENV")))
    assert names
    assert {name.lower() for name in names} <= set(Settings.model_fields)


def health_check() -> list[str]:
    (text,) = of("HEALTHCHECK", LAST)
    assert {"--interval=10s", "--timeout=3s", "--start-period=20s"} <= set(text.split())
    command: list[str] = json.loads(text.partition("CMD ")[2])
    return command


def test_the_health_check_asks_what_needs_no_key() -> None:
    assert any("/health/live" in word for word in health_check())


@pytest.mark.timeout(1200)
def test_the_steps_make_a_service_that_runs_from_the_image_alone(tmp_path: Path) -> None:
    """The build stage in a clean folder, then the image's own command and its health check, without the project."""
    tmp_path.chmod(0o755)
    environment = replay(BUILD, tmp_path)
    port = free_port()
    data = tmp_path / "data"
    data.mkdir()
    (tmp_path / "tmp").mkdir()
    environment |= {
        "SPINEWATCH_DATABASE_URL": f"sqlite:///{data / 'spinewatch.sqlite'}",
        "SPINEWATCH_PORT": str(port),
        "SPINEWATCH_BEHIND_PROXY": "true",
        "PYTHONDONTWRITEBYTECODE": "1",
        "TMPDIR": str(tmp_path / "tmp"),
    }
    command = json.loads(placed(of("CMD", LAST)[0], tmp_path))
    as_user = []
    if os.geteuid() == 0 and anyone_may_run(base_python()):
        as_user = ["setpriv", "--reuid", "10001", "--regid", "10001", "--clear-groups"]
        for folder in (data, tmp_path / "tmp"):
            os.chown(folder, 10001, 10001)
        for parent in tmp_path.parents:
            if parent.owner() == "root" and parent != Path("/"):
                parent.chmod(parent.stat().st_mode | 0o011)
    before = written(tmp_path)
    with (tmp_path / "log.txt").open("wb") as log:
        service = subprocess.Popen([*as_user, *command], cwd=data, env=environment, stdout=log, stderr=log)
    try:
        check = [word.replace("127.0.0.1:8000", f"127.0.0.1:{port}") for word in health_check()]

        def healthy() -> bool:
            assert service.poll() is None, (tmp_path / "log.txt").read_text()
            run = subprocess.run(
                [*as_user, *check], cwd=data, env=environment, capture_output=True, check=False
            )
            return run.returncode == 0

        wait_for(healthy, "the service to be healthy", 0.2)
        bill = subprocess.run(
            [*as_user, "spinewatch", "sbom"],
            cwd=data,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        assert "SHA-256" in bill.stdout
    finally:
        service.terminate()
        assert service.wait(30) == 0
    assert written(tmp_path) == before  # as on a read-only root


def written(folder: Path) -> set[str]:
    """Return the files of the replayed image outside the places that may be written."""
    return {str(path) for path in (folder / "opt").rglob("*")} | {
        str(path) for path in folder.glob("*") if path.name != "log.txt"
    }
