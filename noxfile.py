"""The sessions.

tests, lowest, lint, docs, wasm, reports, bench, verify, fuzz, integrations, and release: the checks
of a release, which ``.ci/run`` leaves out.
"""

import re
import shutil
import sys
from functools import cache
from pathlib import Path

import nox

nox.needs_version = ">=2024.3.2"
nox.options.default_venv_backend = "venv"
nox.options.reuse_existing_virtualenvs = True
nox.options.sessions = ["tests"]

# The studies that the reports read, and the options of those whose default budget takes long. The
# pages say what their studies were made with.
STUDIES = {
    "table4 fig1 fig4 sensitivity fig5-paper sweet-spot-paper": "",
    "pads": "--missions 200",
    "fig5": "--policy ddqn --policy greedy --policy random --policy random-unguarded",
    "comparison failures": "--missions 400",
    "sweet-spot": "--policy ddqn --policy greedy",
    "age": "",
    "planning": "",
    "gap": "--missions 20 --policy greedy --policy ddqn --policy planner",
    "seas": "--missions 1 --policy generalist --policy greedy --policy planner-short",
    "seas-landing seas-horizon": "--missions 1 --policy generalist --policy greedy",
}
# Runs commands in one process, since each would start workers and import libraries for seconds.
ONE_AFTER_THE_OTHER = """
import sys
from dess.reports.cli import main

for command in sys.argv[1:]:
    print("dess", command, flush=True)
    if code := main(command.split()):
        sys.exit(code)
"""
# What says which libraries are installed.
REQUIREMENTS = ("pyproject.toml", "constraints.txt")
# Two test files at a time, in the order of their collection.
SIDE_BY_SIDE = ("-n", "2", "--dist", "loadfile", "--no-loadscope-reorder")
# The tests and the fuzzer simulate little and compile much, so they compile with less optimization,
# which changes no number, into a cache of their own. All other sessions compile as users do.
QUICK_COMPILING = {"NUMBA_OPT": "1", "NUMBA_CACHE_DIR": str(Path("build/numba").resolve())}
# They start many processes, each of which would compile all modules for Python.
QUICK_COMPILING["PYTHONDONTWRITEBYTECODE"] = ""
RESULTS, REPORTS = Path("results"), Path("build/reports")
TYPESCRIPT, TYPESCRIPT_VERSION = Path("build/typescript"), "5.9.3"
# Beside the quick tests, what shows the lowest versions of the libraries for pages and commands.
LOWEST = ("tests/reports/pages/test_body.py", "tests/reports/cli/test_lists.py")
LOWEST += ("tests/reports/cli/test_console.py", "tests/analysis/results/test_parquet.py")
# The tests of a library, and the pins of one that cannot be installed with those of the project.
LIBRARIES, PINS = Path("tests/integrations"), Path("examples/requirements")
FORCED = {"pufferlib"}  # asks for libraries that it does not need; its pins are all that it needs


def install(session: nox.Session, extras: str = "") -> None:
    """Install the project and its pinned libraries; editable, so compiled code stays cached.

    An environment in which this has been done with the same requirements is left as it is. With
    ``nox --no-venv`` all sessions use the present one, which has to have all: see ``.ci/run``.
    """
    if session.virtualenv.venv_backend == "none":
        return
    wanted = "\n".join([extras, *(Path(f).read_text("utf-8") for f in REQUIREMENTS)])
    done = Path(session.virtualenv.location, "requirements-installed.txt")
    if done.exists() and done.read_text("utf-8") == wanted:
        return
    session.log("Installing dess and its libraries; the first time this takes some minutes.")
    session.install("-e", f".{extras}", "-c", "constraints.txt")
    done.write_text(wanted, "utf-8")


@nox.session
def tests(session: nox.Session) -> None:
    """Run the tests."""
    install(session, "[test]")
    session.run("pytest", "-q", *SIDE_BY_SIDE, *session.posargs, env=QUICK_COMPILING)


@nox.session
def lowest(session: nox.Session) -> None:
    """Install the lowest versions that ``pyproject.toml`` allows, and run the quick tests.

    With ``--no-venv`` it only finds out whether these versions fit together.
    """
    bounds = re.findall(r'"([\w.-]+)>=([\w.]+)', Path("pyproject.toml").read_text("utf-8"))
    pins = {name: f"{name}=={version}" for name, version in bounds}
    # Of older ones, PyPI has only builds with CUDA, of several GB.
    pins |= {"torch": re.findall("^torch==.*", Path("constraints.txt").read_text("utf-8"), re.M)[0]}
    # Not in a folder of the session, which nox would take for its environment the next time.
    constraints = Path("build", "lowest.txt")
    constraints.parent.mkdir(exist_ok=True)
    constraints.write_text("\n".join(pins.values()), "utf-8")
    wanted = ("-e", ".[test]", "-c", str(constraints))
    if session.virtualenv.venv_backend == "none":
        session.run("pip", "install", "-q", "--dry-run", "--ignore-installed", *wanted)
        return
    session.install(*wanted)
    session.run("pytest", "-q", "-m", "quick", *session.posargs)
    session.run("pytest", "-q", *LOWEST, *session.posargs)


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
    session.run("python", "-m", "tests.fuzz", *session.posargs, env=QUICK_COMPILING)


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, format and types; of the scripts of pages too, where Node.js is."""
    install(session, "[all,lint]")  # types of the optional libraries are checked too
    session.run("ruff", "check")
    session.run("ruff", "format", "--check")
    session.run("mypy")
    check_scripts(session)


def check_scripts(session: nox.Session) -> None:
    """Check the types that scripts of pages have in comments, with a pinned TypeScript."""
    tsc = TYPESCRIPT / "node_modules/.bin/tsc"
    if not tsc.exists() and shutil.which("npm"):
        TYPESCRIPT.mkdir(parents=True, exist_ok=True)
        wanted = (f"typescript@{TYPESCRIPT_VERSION}", "--no-save", "--no-audit", "--no-fund")
        once = ("--fetch-retries=0", "--prefix", str(TYPESCRIPT))
        session.run("npm", "install", *wanted, *once, external=True, success_codes=range(256))
    if not tsc.exists():
        session.warn("The scripts of pages are not checked: there is no Node.js with TypeScript.")
        return
    for scripts in ("page", "worker"):
        session.run(str(tsc), "-p", f"tools/types/{scripts}.json", external=True)


@nox.session
def docs(session: nox.Session) -> None:
    """Build the documentation as a site; a broken link fails."""
    install(session, "[docs]")
    session.run("mkdocs", "build", "--strict", env={"NO_MKDOCS_2_WARNING": "1"})
    session.log(f"The site is at {Path('build/site/index.html').resolve().as_uri()}")


@nox.session
def wasm(session: nox.Session) -> None:
    """Build the WebAssembly module; ``-- --check`` compares it with what would be built."""
    install(session, "[reports]")  # with the example of the index
    if session.virtualenv.venv_backend != "none":
        session.install("ziglang", "-c", "constraints.txt")
    fixed = {"PYTHONHASHSEED": "0"}
    session.run("python", "tools/wasm/build_module.py", *session.posargs, env=fixed)


@nox.session
def reports(session: nox.Session) -> None:
    """Run the studies, then render the reports; ``-- --full`` simulates all policies of each.

    ``-- --dry-run`` only prints the plans of the studies.
    """
    full, dry = (session.posargs == [option] for option in ("--full", "--dry-run"))
    if session.posargs and not full and not dry:
        unknown = " ".join(session.posargs)
        session.error(f"reports: {unknown} is unknown; allowed: --full, --dry-run")
    install(session, "[reports]")
    results, reports = (folder / "full" if full else folder for folder in (RESULTS, REPORTS))
    commands = []
    for studies, less in STUDIES.items():
        out = results if " " in studies else results / studies
        budget = "" if full else f" {less}"
        commands.append(f"study run {studies} --out {out} --workers 2{budget}")
    if dry:
        commands = [f"{command} --dry-run" for command in commands]
    else:
        commands.append(f"report --results {results} --out {reports}")
    session.run("python", "-P", "-c", ONE_AFTER_THE_OTHER, *commands)
    if dry:
        return
    session.log(f"The reports are at {(reports / 'index.html').resolve().as_uri()}")


@nox.session
def bench(session: nox.Session) -> None:
    """Measure the speed of the engines."""
    install(session, "[test]")
    session.run("pytest", "benchmarks", *session.posargs)


@nox.session
def release(session: nox.Session) -> None:
    """Check that a release is whole and can be installed; ``-- --check``. It uploads nothing.

    It installs wheel, sdist and zip with the oldest and the newest Python, one after the other, and
    takes half an hour to an hour and 2 GB; ``docs/maintaining.md`` has the other steps.
    """
    if not session.posargs:
        session.error("release: an argument is missing; allowed: --check")
    if session.posargs != ["--check"]:
        session.error(f"release: {' '.join(session.posargs)} is unknown; allowed: --check")
    if session.virtualenv.venv_backend != "none":
        session.install("hatchling", "pytest", "pyyaml", "-c", "constraints.txt")
    session.run("python", "-m", "tests.release")


@nox.session(python=False)
def integrations(session: nox.Session) -> None:
    """Check the environments in other libraries; ``-- NAME`` checks one, and writes no matrix.

    ``-- --collect-only`` needs none of the libraries: it collects the tests.
    """
    if session.posargs == ["--collect-only"]:
        # Without its library, a file of tests is skipped: then no test is found (5).
        session.run("pytest", "-q", str(LIBRARIES), *session.posargs, success_codes=[0, 5])
        return
    names = sorted(path.stem.removeprefix("test_") for path in LIBRARIES.glob("test_*.py"))
    if unknown := set(session.posargs) - set(names):
        session.error(f"integrations: {', '.join(unknown)} is unknown; allowed: {', '.join(names)}")
    reports, full = Path("build/integrations"), not session.posargs
    shutil.rmtree(reports, ignore_errors=True)
    for name in session.posargs or names:
        own = (PINS / f"{name}.txt").exists()
        python = environment_of(session, name if own else "together")
        tests = LIBRARIES / f"test_{name}.py"
        report = f"--junitxml={reports / name}.xml"
        codes = range(6) if full else [0]  # the matrix shows what failed
        run(session, python, "pytest", "-q", str(tests), report, success_codes=codes)
    if full:
        run(session, sys.executable, "tests.integrations.matrix", str(reports))


@cache
def environment_of(session: nox.Session, name: str) -> str:
    """The Python of a virtual environment: of a library with pins of its own, or of all others."""
    own, folder = PINS / f"{name}.txt", Path(".nox", "integrations", name)
    python = str(folder.resolve() / "bin" / "python")
    if not Path(python).exists():
        run(session, sys.executable, "venv", str(folder))
    wanted = ["-e", ".[examples]", "-c", "constraints.txt"]
    if name in FORCED:
        wanted[1] = ".[learning]"
    elif own.exists():  # its pins replace those of the project
        pins = Path("constraints.txt").read_text("utf-8").splitlines()
        replaced = {line.split("==")[0] for line in own.read_text("utf-8").splitlines()}
        kept = [line for line in pins if line.split("==")[0] not in replaced]
        constraints = folder / "constraints.txt"
        constraints.write_text("\n".join(kept), "utf-8")
        wanted = ["-e", ".", "-r", str(own), "-c", str(constraints)]
    run(session, python, "pip", "install", "-q", "pytest", "hypothesis", *wanted)
    if name in FORCED:
        run(session, python, "pip", "install", "-q", "--no-deps", "-r", str(own))
    return python


def run(session: nox.Session, python: str, module: str, *arguments: str, **options: object) -> None:
    """Run a module with the Python of another environment."""
    session.run(python, "-m", module, *arguments, external=True, **options)
