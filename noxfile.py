"""The sessions: tests, lint, docs, reports, bench, verify, fuzz. ``nox -l`` lists them."""

from pathlib import Path

import nox

nox.needs_version = ">=2024.3.2"
nox.options.default_venv_backend = "venv"
nox.options.reuse_existing_virtualenvs = True
nox.options.sessions = ["tests"]

# The studies that the reports read. Where the default budget is too small for all policies, these
# are simulated.
STUDIES: dict[str, list[str]] = {
    "fig1": [],
    "table4": [],
    "fig4": [],
    "fig5": ["ddqn", "greedy"],
    "sweet-spot": ["ddqn", "greedy"],
    "sensitivity": [],
    "comparison": [],
    "explorer": [],
    "verification": [],
}
# Two test files at a time, in the order of their collection.
SIDE_BY_SIDE = ("-n", "2", "--dist", "loadfile", "--no-loadscope-reorder")
RESULTS, REPORTS = Path("results"), Path("build/reports")


def install(session: nox.Session, extras: str = "") -> None:
    """Install the project and its pinned libraries; editable, so compiled code stays cached."""
    session.log("Installing dess and its libraries; the first time this takes some minutes.")
    session.install("-e", f".{extras}", "-c", "constraints.txt")


@nox.session
def tests(session: nox.Session) -> None:
    """Run the tests."""
    install(session, "[test]")
    session.run("pytest", "-q", *SIDE_BY_SIDE, *session.posargs)


@nox.session
def verify(session: nox.Session) -> None:
    """Run the longer proofs: the slow tests, with many more hypothesis examples."""
    install(session, "[test,docs]")
    slow = ("-m", "slow", "--hypothesis-profile=verify")
    session.run("pytest", "-q", *slow, *SIDE_BY_SIDE, *session.posargs)


@nox.session
def fuzz(session: nox.Session) -> None:
    """Try bad inputs, signals and forged files; ``-- --minutes 10 --seed N`` are its parameters."""
    install(session, "[test]")
    session.run("python", "-m", "tests.fuzz", *session.posargs)


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, format and types."""
    install(session, "[all,lint]")  # types of the optional libraries are checked too
    session.run("ruff", "check")
    session.run("ruff", "format", "--check")
    session.run("mypy")


@nox.session
def docs(session: nox.Session) -> None:
    """Build the documentation as a site; a broken link fails."""
    install(session, "[docs]")
    session.run("mkdocs", "build", "--strict", env={"NO_MKDOCS_2_WARNING": "1"})
    session.log(f"The site is at {Path('build/site/index.html').resolve().as_uri()}")


@nox.session
def reports(session: nox.Session) -> None:
    """Run the studies, then render the reports; ``-- --full`` simulates all policies of each."""
    full = "--full" in session.posargs
    if session.posargs not in ([], ["--full"]):
        session.error(f"reports: {' '.join(session.posargs)} is unknown; allowed: --full")
    install(session, "[learning,reports]")
    results, reports = (folder / "full" if full else folder for folder in (RESULTS, REPORTS))
    for study, few in STUDIES.items():
        policies = [word for policy in few if not full for word in ("--policy", policy)]
        out = ["--out", str(results / study), "--workers", "2"]
        session.run("dess", "study", "run", study, *out, *policies)
    session.run("dess", "timing", "--out", str(results / "timing"))
    session.run("dess", "report", "--results", str(results), "--out", str(reports))
    session.log(f"The reports are at {(reports / 'index.html').resolve().as_uri()}")


@nox.session
def bench(session: nox.Session) -> None:
    """Measure the speed of the engines."""
    install(session, "[test]")
    session.run("pytest", "benchmarks", *session.posargs)
