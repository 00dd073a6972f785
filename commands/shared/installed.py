"""Installed distributions that Spinewatch is made of: versions, licences, what requires what, hashes of the lock."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution, distributions

ROOT = "spinewatch"
UNKNOWN = "unknown"

_REQUIREMENT = re.compile(r"\s*([A-Za-z0-9._-]+)\s*(?:\[([^\]]*)\])?")
_EXTRA = re.compile(r"extra\s*==\s*['\"]([\w.-]+)['\"]")
_LOCKED = re.compile(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)(.*?)(?=^\S|\Z)", re.MULTILINE | re.DOTALL)
_HASH = re.compile(r"--hash=sha256:([0-9a-f]{64})")
_CLASSIFIER = "License :: "
_MAX_LICENCE_LENGTH = 100
_MIT = "Permission is hereby granted, free of charge, to any person obtaining a copy of this software"


@dataclass(frozen=True)
class Package:
    """An installed distribution.

    Attributes
    ----------
    name, version
        As its metadata says; the name is normalized (PEP 503).
    licence
        An SPDX expression, or the name of the licence, or ``UNKNOWN``.
    is_expression
        Whether the licence is an SPDX expression.
    maker
        Author, maintainer or organization, ``UNKNOWN`` when the metadata has none.
    summary, homepage
        As the metadata says, None when it does not.
    requires
        Names of the installed distributions that it requires.
    optional
        Whether only an extra of Spinewatch requires it.
    hashes
        SHA-256 of the files that the lock allows for this version; empty when the lock does not have it.
    """

    name: str
    version: str
    licence: str
    is_expression: bool
    maker: str
    summary: str | None
    homepage: str | None
    requires: tuple[str, ...]
    optional: bool
    hashes: tuple[str, ...]


def packages(lock: str, *, everything: bool = False) -> list[Package]:
    """Return Spinewatch and what it requires, extras included where they are installed, sorted by name.

    ``lock`` is the content of a requirements file with hashes, or empty; with ``everything``, all distributions of this
    Python environment are returned, tools of developers too.
    """
    hashes = locked_hashes(lock)
    needed = _closure(ROOT, set())
    whole = _closure(ROOT, _extras(ROOT))
    names = {_normal(d.name) for d in distributions()} if everything else set(whole)
    return [_package(name, whole.get(name), needed, hashes) for name in sorted(names | {ROOT})]


def locked_hashes(lock: str) -> dict[tuple[str, str], tuple[str, ...]]:
    """Return the hashes of a requirements file by name and version."""
    return {
        (_normal(name), version): tuple(_HASH.findall(rest)) for name, version, rest in _LOCKED.findall(lock)
    }


def _package(
    name: str,
    requires: Iterable[str] | None,
    needed: Mapping[str, Iterable[str]],
    hashes: Mapping[tuple[str, str], tuple[str, ...]],
) -> Package:
    found = distribution(name)
    licence, is_expression = _licence(found)
    return Package(
        name=name,
        version=found.version,
        licence=licence,
        is_expression=is_expression,
        maker=_maker(found),
        summary=_field(found, "Summary"),
        homepage=_homepage(found),
        requires=tuple(sorted(_required(name, set()) if requires is None else requires)),
        optional=name not in needed,
        hashes=hashes.get((name, found.version), ()),
    )


def _closure(root: str, extras: set[str]) -> dict[str, set[str]]:
    """Return what each distribution requires, for all that a root with some of its extras needs."""
    found: dict[str, set[str]] = {}
    seen: dict[str, set[str]] = {}
    waiting: list[tuple[str, set[str]]] = [(root, extras)]
    while waiting:
        name, wanted = waiting.pop()
        if name in seen and wanted <= seen[name]:
            continue
        seen[name] = seen.get(name, set()) | wanted
        required = _required(name, seen[name])
        found[name] = set(required)
        waiting += required.items()
    return found


def _required(name: str, extras: set[str]) -> dict[str, set[str]]:
    """Return the installed distributions that one requires, each with the extras that it asks for."""
    required: dict[str, set[str]] = {}
    for line in distribution(name).requires or ():
        text, _, marker = line.partition(";")
        extra = _EXTRA.search(marker)
        match = _REQUIREMENT.match(text)
        if match is None or (extra is not None and _normal(extra[1]) not in extras):
            continue
        other = _normal(match[1])
        if _is_installed(other) and other != name:
            wanted = {_normal(word) for word in (match[2] or "").split(",") if word.strip()}
            required[other] = required.get(other, set()) | wanted
    return required


def _extras(name: str) -> set[str]:
    return {_normal(extra) for extra in distribution(name).metadata.get_all("Provides-Extra") or ()}


def _field(found: Distribution, name: str) -> str | None:
    values = found.metadata.get_all(name)
    return str(values[0]) if values else None


def _is_installed(name: str) -> bool:
    try:
        distribution(name)
    except PackageNotFoundError:
        return False
    return True


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name.strip()).lower()


def _licence(found: Distribution) -> tuple[str, bool]:
    """Return the licence, and whether it is an SPDX expression."""
    expression = _field(found, "License-Expression")
    if expression:
        return expression, True
    names = [
        entry.rpartition(" :: ")[2]
        for entry in found.metadata.get_all("Classifier") or ()
        if entry.startswith(_CLASSIFIER) and not entry.endswith("OSI Approved")
    ]
    text = (_field(found, "License") or "").strip()
    if names:
        return " / ".join(names), False
    if text and "\n" not in text and len(text) <= _MAX_LICENCE_LENGTH:
        return text, False
    files = (file for file in found.files or () if "LICENSE" in file.name.upper())
    if any(_MIT in " ".join(file.read_text(encoding="utf-8").split()) for file in files):
        return "MIT", True
    return UNKNOWN, False


def _maker(found: Distribution) -> str:
    for field in ("Author", "Maintainer"):
        text = _field(found, field)
        if text:
            return " ".join(text.split())
    for field in ("Author-email", "Maintainer-email"):
        text = _field(found, field)
        if text:
            names = [entry.partition("<")[0].strip(" \"'") or entry.strip() for entry in text.split(",")]
            return ", ".join(name for name in names if name)
    return UNKNOWN


def _homepage(found: Distribution) -> str | None:
    page = _field(found, "Home-page")
    if page:
        return page
    urls = dict(entry.split(",", 1) for entry in found.metadata.get_all("Project-URL") or () if "," in entry)
    named = {name.strip().lower(): url.strip() for name, url in urls.items()}
    return next((named[key] for key in ("homepage", "home", "source", "repository") if key in named), None)
