from collections.abc import Callable

import pytest

from settings import values

TAKEN: list[tuple[Callable[[str], str], list[str]]] = [
    (
        values.host_names,
        [
            "",
            "spine.example",
            "spine.example, other.example",
            "localhost",
            "or-3",
            "192.0.2.7",
            "2001:db8::7",
        ],
    ),
    (
        values.origins,
        ["", "https://dashboard.example", "https://a.example, http://b.example:8080", "http://[::1]:5173"],
    ),
    (values.proxies, ["", "127.0.0.1", "172.30.8.0/24", "192.0.2.0/24,127.0.0.0/8", "::1, 2001:db8::/32"]),
    (
        values.database_url,
        [
            "sqlite:////data/x.sqlite",
            "sqlite:///var/x.sqlite",
            "postgresql://u:p@host/name",
            "nonsense",
        ],
    ),
    (values.queue_url, ["sqlite:////data/q.sqlite", "redis://:p@host:6379/0", "rediss://host"]),
    (values.pattern, ["K[0-9]{4}"]),
]
REFUSED: list[tuple[Callable[[str], str], list[str], str]] = [
    (
        values.host_names,
        [
            "http://foo",
            "foo bar",
            "*",
            "foo:8000",
            "foo/",
            "[::1]",
            "foo.",
            ".foo",
            "0.0.0.0",  # noqa: S104 - refused
            "::",
            "ok, *",
            "m\u00fcller",
        ],
        "without scheme and port, such as spine.example",
    ),
    (
        values.origins,
        [
            "dashboard.example",
            "*",
            "null",
            "https://dashboard.example/",
            "https://dashboard.example/page",
            "https://Dashboard.example",
            "https://dashboard.example:443",
            "http://dashboard.example:80",
            "https://dashboard.example:70000",
            "https://*.example",
            "ftp://dashboard.example",
            "https://",
        ],
        "such as https://dashboard.example",
    ),
    (
        values.proxies,
        ["999.1.1.1", "*", "0.0.0.0/0", "::/0", "localhost", "192.0.2.7/24", "127.0.0.1, *", "proxy"],
        "such as 192.0.2.7 or 192.0.2.0/24",
    ),
    (
        values.database_url,
        ["sqlite://", "sqlite:///:memory:", "sqlite+pysqlite://", "sqlite:///file:x?mode=memory&uri=true"],
        "name a file",
    ),
    (values.queue_url, ["sqlite:///:memory:", "sqlite://"], "name a file"),
    (values.database_url, ["postgresql://host:port/x"], "port .* is not a number"),
    (values.pattern, ["(", "[a", "a{99999999999999999999}"], "not a regular expression"),
    (values.pattern, ["(?=a)a"], "look-around"),
]


@pytest.mark.parametrize(("check", "text"), [(check, text) for check, texts in TAKEN for text in texts])
def test_a_value_that_can_work_is_kept(check: Callable[[str], str], text: str) -> None:
    assert check(text) == text


@pytest.mark.parametrize(
    ("check", "text", "words"), [(check, text, words) for check, texts, words in REFUSED for text in texts]
)
def test_a_value_that_can_never_work_is_refused_with_the_right_form(
    check: Callable[[str], str], text: str, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        check(text)
