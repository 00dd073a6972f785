"""Multipart forms that are broken, too rich, or say one thing twice."""

import resource
from pathlib import Path

import pytest

from tests.hostile.attack import harmless, refused
from tests.http.harness import Service, code_of, pair, problem_of

FORM = {"Content-Type": "multipart/form-data; boundary=x"}
PATHS = [
    "/v1/surgeries/{surgery}/stages",
    "/v1/calibrations/from-images",
    "/v1/surgeries/{surgery}/radiographs",
]


def part(name: str, content: bytes, more: str = "", *lines: str) -> bytes:
    head = "\r\n".join([f'--x\r\nContent-Disposition: form-data; name="{name}"{more}', *lines])
    return head.encode() + b"\r\n\r\n" + content + b"\r\n"


BODIES = {
    "no parts": b"--x--\r\n",
    "nothing": b"",
    "no end": part("left", b"x" * 100, '; filename="l"')[:-20],
    "not a form": b"\x00" * 100_000,
    "part without a name": b"--x\r\nContent-Disposition: form-data\r\n\r\n1\r\n--x--\r\n",
    "part without a disposition": b"--x\r\nContent-Type: text/plain\r\n\r\n1\r\n--x--\r\n",
    "5,000 parts": b"".join(part(f"p{n}", b"") for n in range(5_000)) + b"--x--\r\n",
    "5,000 files": b"".join(part("left", b"x", '; filename="l"') for _ in range(5_000)) + b"--x--\r\n",
    "many headers": part("left", b"x", "", *(f"X-{n}: 1" for n in range(5_000))) + b"--x--\r\n",
    "long header": part("left", b"x", "", "X: " + "y" * 5_000_000) + b"--x--\r\n",
    "long name": part("n" * 1_000_000, b"x") + b"--x--\r\n",
    "long text": part("name", b"x" * 30_000_000) + b"--x--\r\n",
    "line breaks": part("left", b"\r\n" * 15_000_000, '; filename="l"') + b"--x--\r\n",
    "nearly boundaries": part("left", b"\r\n--" * 7_500_000, '; filename="l"') + b"--x--\r\n",
    "many long texts": b"".join(part(f"p{n}", b"x" * 120_000) for n in range(130)) + b"--x--\r\n",
    "many long tables": b"".join(part(f"p{n}", b"1,2,3,4\n" * 15_000) for n in range(130)) + b"--x--\r\n",
    "30 texts of a megabyte": b"".join(part(f"p{n}", b"x" * 1_000_000) for n in range(30)) + b"--x--\r\n",
    "a long file": part("left", b"x" * 30_000_000, '; filename="l"') + b"--x--\r\n",
    "120 files": b"".join(
        part(side, bytes([n, len(side)]) * 120_000, '; filename="l"')
        for n in range(60)
        for side in ("left", "right")
    )
    + b"--x--\r\n",
    "long preamble": b"y" * 10_000_000 + b"\r\n" + part("left", b"x") + b"--x--\r\n",
    "nested": part(
        "left",
        b'--y\r\nContent-Disposition: form-data; name="z"\r\n\r\n1\r\n--y--',
        "",
        "Content-Type: multipart/mixed; boundary=y",
    )
    + b"--x--\r\n",
    "NUL in a text": part("name", b"a\x00b") + b"--x--\r\n",
    "not UTF-8": part("name", b"\xff\xfe\xfd") + b"--x--\r\n",
    "markup in a file name": part("left", b"x", '; filename="<script>alert(1)</script>"') + b"--x--\r\n",
    "path in a file name": part("left", b"x", '; filename="../../etc/passwd"') + b"--x--\r\n",
}


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_a_form_is_refused_cheaply(service: Service, surgery: str, path: str, body: bytes) -> None:
    with harmless(service, requests=2 + len(body) // 10_000_000):
        answer = service.client.post(path.format(surgery=surgery), content=body, headers=FORM)
    refused(service, answer)
    assert "script" not in answer.text
    assert "passwd" not in answer.text


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize(
    "kind",
    ["multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=" + "x" * 3_000],
)
def test_a_boundary_that_is_none(service: Service, surgery: str, path: str, kind: str) -> None:
    with harmless(service):
        answer = service.client.post(
            path.format(surgery=surgery), content=part("name", b"PRE"), headers={"Content-Type": kind}
        )
    refused(service, answer)


def test_a_form_larger_than_the_limit(service: Service, surgery: str) -> None:
    with harmless(service):
        answer = service.client.post(
            PATHS[0].format(surgery=surgery), content=b"x" * 33_554_433, headers=FORM
        )
    assert code_of(answer, 413) == "content-too-large"


@pytest.mark.parametrize(
    ("path", "name"), [(PATHS[0], "name"), (PATHS[1], "control_field"), (PATHS[2], "image")]
)
def test_a_part_given_twice(service: Service, surgery: str, path: str, name: str) -> None:
    body = part(name, b"A") + part(name, b"B") + b"--x--\r\n"
    answer = service.client.post(path.format(surgery=surgery), content=body, headers=FORM)
    (error,) = problem_of(answer, 422)["errors"]
    assert error["loc"] == ["body", name]
    assert "twice" in error["msg"]


@pytest.mark.parametrize("more", ["", "; filename*=UTF-8''left.png"])
@pytest.mark.parametrize(("path", "name"), [(PATHS[0], "left"), (PATHS[1], "right"), (PATHS[2], "image")])
def test_a_file_without_a_plain_name(service: Service, surgery: str, path: str, name: str, more: str) -> None:
    body = part(name, b"PNG", more) + b"--x--\r\n"
    answer = service.client.post(path.format(surgery=surgery), content=body, headers=FORM)
    (error,) = problem_of(answer, 422)["errors"]
    assert error["loc"] == ["body", name]
    assert "filename" in error["msg"]


def test_repeated_files_of_a_burst_are_no_repetition(service: Service, surgery: str) -> None:
    body = part("left", b"A", '; filename="1"') + part("left", b"B", '; filename="2"') + b"--x--\r\n"
    answer = service.client.post(PATHS[0].format(surgery=surgery), content=body, headers=FORM)
    assert "twice" not in problem_of(answer, 422)["errors"][0]["msg"]


def test_temporary_files_without_room_are_not_the_clients_fault(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        surgery, calibration = service.surgery(), service.calibration()
        _, hard = resource.prlimit(service.server.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(service.server.pid, resource.RLIMIT_FSIZE, (600_000, hard))
        answer = service.send(surgery, "PRE", (b"x" * 2_000_000, b"y"), calibration)
        assert code_of(answer, 507) == "insufficient-storage"
        assert "TMPDIR" in answer.json()["detail"]
        resource.prlimit(service.server.pid, resource.RLIMIT_FSIZE, (hard, hard))
        assert service.send(surgery, "PRE", pair("PRE"), calibration).status_code == 202
