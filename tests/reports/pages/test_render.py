"""Rendering, with tiny notebooks: complete pages that are the same whenever they are made, or an
error in one line."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from dess import InputError, __version__
from dess.analysis import run_study
from dess.reports.cli import main
from dess.reports.pages import kernels
from dess.reports.pages.body import make_page
from dess.reports.pages.notebook import PARAMETERS, Report, read_report, report_names
from dess.reports.pages.render import ReportError, render
from tests.analysis.small import small_study
from tests.reports.here import notebooks_here
from tests.reports.small import Links, words_of

HEAD = """
# ---
# jupyter:
#   dess:
#     studies: [{}]
# ---

# %% [markdown]
# # {}
#
# {}

# %% tags=["parameters"]
results = "../../results"
"""
MISSION = HEAD.format("trial", "A trial", "The missions of a trial.")
MISSION += """policy = "greedy"

# %%
import sys
from pathlib import Path

from matplotlib.figure import Figure

from dess.analysis import load_results
from dess import InputError
from dess.reports.pages.parts import make_figure
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

study = load_results(Path(results) / "trial")
if policy not in study.policies:
    raise InputError("policy", f"{policy} is not in the study", "greedy")

# %% [markdown]
# ## The missions, at a charging threshold C_S

# %%
print("a warning", file=sys.stderr)
make_table(study.missions.head(3))

# %%
drawing = Figure(figsize=(4, 3))
drawing.subplots().plot(study.missions["slots"])
make_figure(drawing, "slots", "Slots of every mission, n = 10.")

# %%
provenance_table([study])
"""
SCORECARD = HEAD.format("", "Scorecard", "The claims.")
SCORECARD += """# %%
from IPython.display import HTML

HTML('<section id="scorecard">one claim</section>')
"""
FAILING = HEAD.format("trial", "Failing", "It fails.")
FAILING += """# %%
"the cell before"

# %%
raise ArithmeticError("no such number")

# %%
"the cell after"
"""
FORMATS = ("svg", "pdf", "png")
LONG = [pytest.mark.slow, pytest.mark.brief]
TINY = {"mission": MISSION, "scorecard": SCORECARD}
# What Python, IPython, Jupyter and the libraries would import or run in a working directory.
MODULES = ("pandas", "sitecustomize", "matplotlib", "joblib", "typer")
MODULES += ("ipython_config", "ipython_kernel_config", "jupyter_config")
STARTUP = ".ipython/profile_default/startup/00.py"
TEMPLATES = ("report.html", "layout.html", "part.html", "base/null.j2")


def write_notebooks(folder: Path, **sources: str) -> Path:
    """A folder with notebooks, by name."""
    folder.mkdir(exist_ok=True)
    for name, source in sources.items():
        (folder / f"{name}.py").write_text(source.lstrip(), "utf-8")
    return folder


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results of the study trial."""
    folder = tmp_path_factory.mktemp("results")
    run_study(small_study(tmp_path_factory.mktemp("study")), folder / "trial")
    return folder


@pytest.fixture(scope="module")
def trap(results):
    """The folder of the results, with files that would run if it is the working directory."""
    for name in (*(f"{module}.py" for module in MODULES), STARTUP):
        file = results / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"open({str(results / 'hit')!r}, 'a').write({name!r})\n")
    for name in TEMPLATES:
        file = results / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("the template of a stranger")
    (results / "matplotlibrc").write_text("this is no setting\n")
    return results


@pytest.fixture(scope="module")
def notebooks(tmp_path_factory):
    return write_notebooks(tmp_path_factory.mktemp("notebooks"), **TINY)


@pytest.fixture(scope="module")
def progress():
    return []


@pytest.fixture
def unrun(monkeypatch):
    """Pages are made of notebooks that have not been run, since a process takes seconds."""
    monkeypatch.setattr(kernels, "run_reports", lambda reports, *_: None)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("out") / "deep" / "reports"


@pytest.fixture(scope="module")
def files(trap, notebooks, out, progress, tmp_path_factory):
    """All files of the reports, rendered once in a folder of traps, by name."""
    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(home))
        patch.delenv("PYTHONSAFEPATH", raising=False)
        patch.chdir(trap)
        note = lambda *step: progress.append(step)  # noqa: E731
        index = render([], ".", out, note, notebooks=notebooks, formats=FORMATS)
        assert index == out / "index.html"
    assert not list(home.glob(".ipython")) + list(home.glob(".jupyter")) + list(home.glob(".local"))
    return {path.name: path.read_text("utf-8") for path in out.glob("*.*")}


def another_environment(results: Path, out: Path, folder: Path, patch: pytest.MonkeyPatch) -> Path:
    """Copies of results and pages in another folder, under another locale and time zone."""
    for name, value in {"TZ": "Pacific/Auckland", "PYTHONHASHSEED": "7", "LC_ALL": "C"}.items():
        patch.setenv(name, value)
    patch.chdir(folder)
    shutil.copytree(results, folder / results.name)
    return shutil.copytree(out, folder / out.relative_to(results.parent))


# --- pages ---


def test_there_are_pages_notebooks_and_an_index_and_nothing_else(files):
    kinds = [f"{name}.{kind}" for name in TINY for kind in ("html", "ipynb")]
    assert {*files} == {*kinds, "index.html"}


def test_a_page_shows_outputs_and_no_warnings(files):
    page = files["mission.html"]
    text = words_of(page)
    assert "Slots of every mission" in text and "charging threshold C S" in text
    assert "a warning" not in text
    assert page.count("<img ") == 1
    assert Links(page).found.count("mission.ipynb") == 1


def test_the_index_has_a_card_per_page_and_every_page_a_bar(files):
    index = files["index.html"]
    assert index.count('<a class="card"') == 2
    assert "The missions of a trial." in index
    for name in TINY:
        bar = re.findall('<nav class="bar".*?</nav>', files[f"{name}.html"], re.S)[0]
        linked = ["index.html", "mission.html", "scorecard.html"]
        assert re.findall('href="([^"]*)"', bar) == linked
        assert f'href="{name}.html" aria-current="page"' in bar
        # A group folds the links to its pages; that of this page is marked.
        assert re.findall('<summary( aria-current="true")?>(.*)</summary>', bar) == [
            (' aria-current="true"' * (name == "mission"), "The policies"),
            (' aria-current="true"' * (name == "scorecard"), "The paper"),
        ]


@pytest.mark.usefixtures("files")
def test_progress_counts_the_cells(progress):
    # Of the mission five cells with code, of the scorecard two.
    assert [(done, total) for done, total, _ in progress] == [(n, 7) for n in range(1, 8)]
    assert {name for *_, name in progress} == {*TINY}


def test_the_same_results_give_the_same_bytes(
    files, results, notebooks, out, tmp_path, monkeypatch
):
    """With figures as files a current page is rendered again; the index shows the other one."""
    folder = another_environment(results, out, tmp_path, monkeypatch)
    made = {p.name: p.read_bytes() for p in (folder / "mission-figures").iterdir()}
    begins = {"figure-1.svg": b"<?xml", "figure-1.pdf": b"%PDF", "figure-1.png": b"\x89PNG"}
    assert {name: content[: len(begins[name])] for name, content in made.items()} == begins
    shutil.rmtree(folder / "mission-figures")
    render(["mission"], tmp_path / results.name, folder, notebooks=notebooks, formats=FORMATS)
    assert {p.name: p.read_bytes() for p in (folder / "mission-figures").iterdir()} == made
    for name, text in files.items():
        assert (folder / name).read_text("utf-8") == text, name


@pytest.mark.slow
@pytest.mark.usefixtures("files")
def test_a_notebook_runs_in_jupyter_and_shows_what_the_page_shows(
    results, notebooks, out, tmp_path, monkeypatch
):
    folder = another_environment(results, out, tmp_path, monkeypatch)
    notebook = nbformat.read(folder / "mission.ipynb", as_version=4)
    nbformat.validate(notebook)
    first = notebook.cells.pop(0).source
    assert first.startswith("# ") and "run all cells" in first
    assert PARAMETERS in notebook.cells[0].metadata.tags
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    kept = "".join(output.data["text/html"] for output in outputs)
    assert kept.count("<img ") == 1 and "Slots of every mission" in kept and "<table" in kept
    assert all(cell.get("execution_count") is None for cell in notebook.cells)
    assert {key for output in outputs for key in output.data} == {"text/html"}
    NotebookClient(notebook, resources={"metadata": {"path": str(folder)}}).execute()
    assert all(cell.execution_count for cell in notebook.cells if cell.cell_type == "code")
    report = read_report("mission", notebooks)
    report.notebook = notebook
    main = make_page(report).text.split("<main>")[1].split('<details class="code">')[0]
    assert "Figure 1" in main and main in (folder / "mission.html").read_text("utf-8")


def test_a_page_runs_nothing_of_the_working_directory(files, trap):
    assert not (trap / "hit").exists()
    assert all("of a stranger" not in text for text in files.values())


def test_processes_of_a_command_import_nothing_of_the_working_directory(trap, monkeypatch):
    def start_a_process(*_: Any, **__: Any) -> int:
        return subprocess.run([sys.executable, "-c", "import joblib"], check=True).returncode

    monkeypatch.chdir(trap)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    monkeypatch.setattr("dess.reports.cli.commands.app", start_a_process)
    assert main([]) == 0
    assert not (trap / "hit").exists() and "PYTHONSAFEPATH" not in os.environ


def test_the_command_imports_nothing_of_the_working_directory(trap):
    variables = os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}
    command = [sys.executable, "-m", "dess", "--version"]
    done = subprocess.run(command, cwd=trap, env=variables, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"dess {__version__}\n")
    assert not (trap / "hit").exists()


# --- input that is refused ---


@pytest.mark.usefixtures("unrun")
def test_pages_without_results_are_left_out_with_a_note(results, tmp_path, caplog):
    """Of all pages; a page that is named must have its results."""
    lacking = MISSION.replace("[trial]", "[trial, fleets, pads]")
    notebooks = write_notebooks(tmp_path / "notebooks", scorecard=SCORECARD, comparison=lacking)
    index = render([], results, tmp_path / "out", notebooks=notebooks)
    assert {path.stem for path in index.parent.iterdir()} == {"index", "scorecard"}
    page = index.read_text("utf-8")
    listed = re.findall("<li>(.*?)</li>", page)
    assert len(listed) == 1
    commands = re.findall("<code>(.*?)</code>", listed[0])
    assert commands == ["dess study run fleets", "dess study run pads"]
    assert "note: report comparison is left out: results: " in caplog.text
    with pytest.raises(InputError, match="of 2 studies; .*: dess study run fleets pads --out"):
        render(["comparison", "scorecard"], results, tmp_path / "a", notebooks=notebooks)
    assert not (tmp_path / "a").exists()


def test_results_of_another_study_are_refused(results, tmp_path):
    (tmp_path / "table4").symlink_to(results / "trial")
    with pytest.raises(InputError, match="table4 holds study trial"):
        render(["performance"], tmp_path, tmp_path / "out")


@pytest.mark.parametrize("runs", [notebooks_here, pytest.param(nullcontext, marks=LONG)])
def test_a_notebook_that_refuses_its_input_leaves_nothing(runs, results, notebooks, tmp_path):
    """Also one that runs in another process, as all do but in these tests."""
    values, line = {"policy": "nobody"}, "^report mission: policy: nobody is not in the study"
    with pytest.raises(InputError, match=line), runs():
        render([], results, tmp_path / "a" / "out", parameters=values, notebooks=notebooks)
    assert os.listdir(tmp_path) == []


# --- notebooks ---


def test_a_path_is_relative_in_the_notebook_and_a_name_on_the_page(
    results, notebooks, tmp_path, monkeypatch
):
    """Values stand in the cell of the parameters; the notebook runs in another folder."""
    ran: list[Report] = []
    monkeypatch.setattr(kernels, "run_reports", lambda reports, *_: ran.extend(reports))
    monkeypatch.chdir(tmp_path)
    given = {"policy": "./sea.toml"}
    render(["mission"], results, "out", parameters=given, notebooks=notebooks)
    assert ran[0].parameters == {"results": str(results), "policy": str(tmp_path / "sea.toml")}
    (cell,) = [c for c in nbformat.read("out/mission.ipynb", 4).cells if c.metadata.get("tags")]
    folder = Path(os.path.relpath(results, "out")).as_posix()
    assert cell.source == f"results = {folder!r}\npolicy = '../sea.toml'"
    page = Path("out/mission.html").read_text("utf-8")
    assert str(tmp_path) not in page and "sea.toml" in page


@pytest.mark.usefixtures("unrun")
def test_a_notebook_that_is_missing_is_written_again(results, notebooks, tmp_path):
    """And one that is there, with the changes of its reader, is left as it is."""
    render(["mission"], results, tmp_path, notebooks=notebooks)
    file = tmp_path / "mission.ipynb"
    written = file.read_text("utf-8")
    changed = written.replace("# A trial", "# My trial")
    file.write_text(changed, "utf-8")
    render(["mission"], results, tmp_path, notebooks=notebooks)
    assert file.read_text("utf-8") == changed
    file.unlink()
    render(["mission"], results, tmp_path, notebooks=notebooks)
    assert file.read_text("utf-8") == written


def test_the_notebook_of_every_shipped_report_is_known_again(tmp_path):
    """That of a report that reads no results, too."""
    for name in report_names():
        report = read_report(name)
        text = report.for_jupyter(tmp_path / "results", tmp_path, {})
        file = tmp_path / f"{name}.ipynb"
        file.write_text(text, "utf-8")
        assert report.is_in(tmp_path, tmp_path / "results")
        if "results" in report.parameters:
            assert not report.is_in(tmp_path, tmp_path / "others")
            file.write_text(text.replace("results = ", "results = 'a' + "), "utf-8")
            assert not report.is_in(tmp_path, tmp_path / "results")
        file.unlink()
        assert not report.is_in(tmp_path, tmp_path / "results")


# --- processes ---


def test_a_notebook_that_fails_or_dies_leaves_a_partial_page_and_names_the_cell(
    results, tmp_path, monkeypatch, capfd
):
    """What a process reports before it dies is part of the line; the others are rendered.

    So it is where the folder for temporary files has a long path.
    """
    (tmp_path / "mission.html").write_text("before")
    long = tmp_path / ("x" * 100)  # too long for the path of a socket
    long.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(long))
    working = FAILING.replace("raise ArithmeticError", "print")
    dying = FAILING.replace("raise", r"import os; os.write(2, b'one\nmemory\n'); os._exit(1) #")
    sources = {"mission": FAILING, "learning": dying, "performance": working}
    notebooks = write_notebooks(tmp_path / "notebooks", **sources)
    with pytest.raises(ReportError) as caught:
        render([], results, tmp_path, notebooks=notebooks)
    failed, dead = str(caught.value).split("; report ")
    assert failed == (
        'report mission: cell 3 of 4 (raise ArithmeticError("no such number")): '
        f"ArithmeticError: no such number; partial page: {tmp_path / 'mission.partial.html'}"
    )
    assert re.match(r"learning: cell 3 of 4 \(import os.*\): its process ended: memory; ", dead)
    assert capfd.readouterr().err == ""
    for name in ("mission", "learning"):
        text = words_of((tmp_path / f"{name}.partial.html").read_text("utf-8"))
        assert f"This page is incomplete. report {name}: cell 3 of 4" in text
        assert "the cell before" in text and "the cell after" not in text
    # The complete page stays.
    assert (tmp_path / "mission.html").read_text() == "before"
    assert "the cell after" in words_of((tmp_path / "performance.html").read_text("utf-8"))
    monkeypatch.setattr(kernels, "run_reports", lambda reports, *_: None)
    render(["mission"], results, tmp_path, notebooks=notebooks)
    assert not (tmp_path / "mission.partial.html").exists()
