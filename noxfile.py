"""The sessions: tests, lint, reports, bench, verify. ``nox -l`` lists them."""

from pathlib import Path

import nox

nox.needs_version = ">=2024.3.2"
nox.options.default_venv_backend = "venv"
nox.options.reuse_existing_virtualenvs = True
nox.options.sessions = ["tests"]

STUDIES = ("table4", "fig4")
RESULTS, REPORTS = Path("results"), Path("build/reports")


def install(session: nox.Session, extras: str = "") -> None:
    """Install the project and its pinned libraries; editable, so compiled code stays cached."""
    session.log("Installing dess and its libraries; the first time this takes some minutes.")
    session.install("-e", f".{extras}", "-c", "constraints.txt")


@nox.session
def tests(session: nox.Session) -> None:
    """Run the tests."""
    install(session, "[test]")
    session.run("pytest", "-q", *session.posargs)


@nox.session
def verify(session: nox.Session) -> None:
    """Run the longer proofs: the slow tests, with many more hypothesis examples."""
    install(session, "[test]")
    session.run("pytest", "-m", "slow", "--hypothesis-profile=verify", *session.posargs)


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, format and types."""
    install(session, "[lint]")
    session.run("ruff", "check")
    session.run("ruff", "format", "--check")
    session.run("mypy")


@nox.session
def reports(session: nox.Session) -> None:
    """Run the studies, then render the reports."""
    install(session)
    for study in STUDIES:
        out = str(RESULTS / study)
        session.run("dess", "study", "run", study, "--out", out, "--workers", "2")
    session.run("dess", "report", "--results", str(RESULTS), "--out", str(REPORTS))
    session.log(f"The reports are at {(REPORTS / 'index.html').resolve().as_uri()}")


@nox.session
def bench(session: nox.Session) -> None:
    """Measure the speed of the engines."""
    install(session, "[test]")
    session.run("pytest", "benchmarks", *session.posargs)
