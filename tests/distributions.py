"""What the distribution asks for, read from pyproject.toml, and what that asks for in turn."""

import tomllib
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS: dict[str, list[str]] = PROJECT["optional-dependencies"]
# What no system in particular needs, all do.
_SYSTEM = dict.fromkeys(("os_name", "sys_platform", "platform_system", "platform_machine"), "other")


def asked(*extras: str) -> list[str]:
    """The requirements of a plain installation, and of one with extras."""
    lines = list(PROJECT["dependencies"])
    for extra in extras:
        for line in EXTRAS[extra]:
            own = Requirement(line)
            lines += asked(*own.extras) if own.name == PROJECT["name"] else [line]
    return list(dict.fromkeys(lines))


def requirements(*lines: str) -> dict[str, Requirement]:
    """Requirements by the canonical name of the distribution."""
    return {canonicalize_name(Requirement(line).name): Requirement(line) for line in lines}


def closure(*lines: str) -> set[str]:
    """What requirements and their requirements ask for, as far as they are installed."""
    pending, seen = [Requirement(line) for line in lines], set()
    while pending:
        requirement = pending.pop()
        name = canonicalize_name(requirement.name)
        for wanted in {(name, extra) for extra in {"", *requirement.extras}}:
            if wanted not in seen:
                seen.add(wanted)
                pending += _needed(*wanted)
    return {name for name, _ in seen}


@cache
def homes() -> dict[str, set[str]]:
    """The installed distributions, by canonical names, of every package that can be imported."""
    found = packages_distributions()
    return {name: {canonicalize_name(home) for home in found[name]} for name in found}


def absent(*extras: str) -> set[str]:
    """The packages here that an installation with these extras does not have."""
    there = closure(*asked(*extras)) | {"dess"}
    return {package for package, found in homes().items() if not found & there}


def _needed(name: str, extra: str) -> list[Requirement]:
    """What an installed distribution asks for with an extra; of another one it is not known."""
    try:
        lines = [Requirement(line) for line in requires(name) or ()]
    except PackageNotFoundError:
        return []
    return [r for r in lines if not r.marker or r.marker.evaluate({**_SYSTEM, "extra": extra})]
