"""Reports: notebooks run on results, each rendered to one self-contained page, and an index."""

import ast
import atexit
import logging
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jupytext
import matplotlib as mpl
import nbformat
from jinja2 import Environment, PackageLoader
from jupyter_client.kernelspec import NATIVE_KERNEL_NAME, KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from markupsafe import Markup
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbconvert import HTMLExporter
from nbformat import NotebookNode
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer

from analysis import load_results
from analysis.store import MANIFEST
from dess.errors import InputError
from reports.page import provenance

log = logging.getLogger(__name__)

# Called with the report's name, the cells done and the cells in all.
Progress = Callable[[str, int, int], None]

INDEX = "index.html"
_IMAGE = re.compile(r"<img [^>]+>")


class ReportError(RuntimeError):
    """A notebook failed; one line that names the report and what its cell raised."""


@dataclass
class Report:
    """A notebook: what the index says of it, and the studies whose results it reads."""

    name: str
    title: str
    description: str
    studies: list[str]
    notebook: NotebookNode
    body: str = ""

    @property
    def page(self) -> str:
        """File name of the page."""
        return f"{self.name}.html"

    @property
    def code(self) -> Markup:
        """The code of all cells, in colour."""
        cells = (cell.source for cell in self.notebook.cells if cell.cell_type == "code")
        return Markup(highlight("\n\n\n".join(cells), PythonLexer(), HtmlFormatter()))

    @property
    def thumbnail(self) -> Markup:
        """The last image of the page, the fullest one."""
        images = _IMAGE.findall(self.body)
        return Markup(images[-1] if images else "")


def report_names() -> list[str]:
    """The names of the shipped reports, in the order of the index."""
    return ["mission", "performance"]


def render(
    names: Iterable[str],
    results: str | Path,
    out: str | Path,
    progress: Progress | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Path:
    """Run reports on the results of studies and write their pages and an index.

    Nothing is written unless every report has run to its end. The same results give the same bytes.

    Args:
        names: The reports; all shipped ones if empty.
        results: The folder that holds a results folder per study.
        out: The folder to write to.
        progress: Called after every cell.
        parameters: Values for the parameters of the notebooks, beside ``results``.

    Returns:
        The path of ``index.html``.

    Raises:
        InputError: If a report or a parameter is unknown, results are missing or ``out`` cannot be
            written.
        ReportError: If a notebook fails.
    """
    results, out = Path(results), Path(out)
    reports = [_read(name) for name in dict.fromkeys(names) or report_names()]
    manifests = {s: _manifest(results / s) for r in reports for s in r.studies}
    _check_parameters(reports, parameters or {})
    with _writing(out):
        out.mkdir(parents=True, exist_ok=True)
        staging = TemporaryDirectory(dir=out, prefix=".rendering-")
    with staging as folder:
        for report in reports:
            _set_parameters(report, {"results": ".", **(parameters or {})})
            _execute(report, results, progress)
            report.body = _body(report.notebook)
        pages = {report.page: _page("report.html", report=report) for report in reports}
        pages[INDEX] = _page(
            INDEX, reports=reports, provenance=Markup(provenance(manifests.values()).data)
        )
        with _writing(out):
            for name, html in pages.items():
                Path(folder, name).write_text(html, "utf-8")
            for name in pages:
                os.replace(Path(folder, name), out / name)
    return out / INDEX


@contextmanager
def _writing(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(f"out: {out} cannot be written: {error.strerror}") from error


def _read(name: str) -> Report:
    """A report from its notebook: the heading is its title, the paragraph below describes it."""
    if name not in report_names():
        raise InputError(f"report: {name!r} is unknown; allowed: {', '.join(report_names())}")
    source = resources.files("reports").joinpath(f"notebooks/{name}.py").read_text("utf-8")
    notebook = jupytext.reads(source, fmt="py:percent")
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number}"
    title, description = notebook.cells[0].source.removeprefix("# ").split("\n\n", 1)
    del notebook.cells[0]  # the page has them in its header
    studies = notebook.metadata["dess"]["studies"]
    return Report(name, title, " ".join(description.split()), studies, notebook)


def _manifest(folder: Path) -> dict[str, Any]:
    if not (folder / MANIFEST).exists():
        raise InputError(
            f"results: {folder} holds no results of study {folder.name}; "
            f"they are made by: dess study run {folder.name} --out {folder}"
        )
    manifest = load_results(folder).manifest
    if manifest["study"]["name"] != folder.name:
        raise InputError(
            f"results: {folder} holds study {manifest['study']['name']}; allowed: {folder.name}"
        )
    return manifest


def _parameter_cell(report: Report) -> int:
    tagged = ("parameters" in cell.metadata.get("tags", []) for cell in report.notebook.cells)
    return list(tagged).index(True)


def _parameters(report: Report) -> set[str]:
    """The names that the notebook's tagged cell assigns."""
    source = report.notebook.cells[_parameter_cell(report)].source
    targets = (node.targets[0] for node in ast.parse(source).body if isinstance(node, ast.Assign))
    return {target.id for target in targets if isinstance(target, ast.Name)}


def _check_parameters(reports: list[Report], parameters: Mapping[str, Any]) -> None:
    known = set().union(*map(_parameters, reports)) - {"results"}
    for name in parameters:
        if name not in known:
            raise InputError(
                f"parameter: {name!r} is unknown to {', '.join(r.name for r in reports)}; "
                f"allowed: {', '.join(sorted(known)) or 'none'}"
            )


def _set_parameters(report: Report, parameters: Mapping[str, Any]) -> None:
    """Insert a cell with the values after the tagged one."""
    known = _parameters(report)
    lines = [f"{name} = {value!r}" for name, value in parameters.items() if name in known]
    cell = nbformat.v4.new_code_cell("\n".join(lines), id="cell-parameters")
    report.notebook.cells.insert(_parameter_cell(report) + 1, cell)


def _execute(report: Report, folder: Path, progress: Progress | None) -> None:
    """Run a report's notebook in ``folder``; once more if its kernel dies before the first cell."""
    done = 0
    total = sum(cell.cell_type == "code" for cell in report.notebook.cells)

    def count(**_: Any) -> None:
        nonlocal done
        done += 1
        if progress:
            progress(report.name, done, total)

    for attempt in (1, 2):
        try:
            with TemporaryDirectory() as home:
                client = _client(report.notebook, folder, Path(home), count)
                _run(client, _environment(Path(home)))
            return
        except CellExecutionError as error:
            if error.ename == InputError.__name__:
                raise InputError(f"report {report.name}: {error.evalue}") from error
            raise ReportError(f"report {report.name}: {error.ename}: {error.evalue}") from error
        except RuntimeError as error:  # the kernel did not start, or died
            if done or attempt == 2:
                raise ReportError(f"report {report.name}: {error}") from error


def _run(client: NotebookClient, environment: dict[str, str]) -> None:
    """Run a notebook in a thread: in this one, nbclient would take Ctrl-C for itself."""
    kernel: Any = client.km
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(client.execute, env=environment, cleanup_kc=True)
        try:
            running.result()
        except KeyboardInterrupt:
            while not running.done():
                if kernel.has_kernel:
                    kernel.provisioner.process.kill()
                wait([running], timeout=0.2)
            raise
        finally:  # nbclient leaves its exit handler behind when a kernel dies at its start
            atexit.unregister(client._cleanup_kernel)


def _client(notebook: NotebookNode, folder: Path, home: Path, count: Any) -> NotebookClient:
    # No kernel specs but the built-in one: an installed "python3" may be another interpreter's.
    kernel = AsyncKernelManager(
        kernel_name=NATIVE_KERNEL_NAME,
        kernel_spec_manager=KernelSpecManager(kernel_dirs=[]),
        connection_file=str(home / "kernel.json"),
    )
    sockets = home / "kernel"
    if os.name == "posix" and len(str(sockets)) < 90:  # no ports to clash on; paths must be short
        kernel.transport, kernel.ip = "ipc", str(sockets)
    return NotebookClient(
        notebook,
        km=kernel,
        resources={"metadata": {"path": str(folder)}},
        on_cell_complete=count,
        timeout=None,
        record_timing=False,
        coalesce_streams=True,
    )


def _environment(home: Path) -> dict[str, str]:
    """The kernel imports what this process imports and leaves nothing in the user's home."""
    own = {name: str(home) for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR")}
    path = os.pathsep.join(os.path.abspath(entry) for entry in sys.path)
    return {
        **os.environ,
        **own,
        "PYTHONPATH": path,
        "MPLBACKEND": "agg",
        "MPLCONFIGDIR": mpl.get_cachedir(),
    }


def _body(notebook: NotebookNode) -> str:
    """The cells as HTML; what they wrote to stderr goes to the log instead."""
    for cell in notebook.cells:
        streams = [o for o in cell.get("outputs", []) if o.get("name") == "stderr"]
        for stream in streams:
            log.warning(stream.text.rstrip())
            cell.outputs.remove(stream)
    exporter = HTMLExporter(
        template_name="basic",
        exclude_input=True,
        exclude_output_prompt=True,
        exclude_anchor_links=True,
    )
    return exporter.from_notebook_node(notebook)[0]


def _page(template: str, **values: Any) -> str:
    environment = Environment(
        loader=PackageLoader("reports", "templates"), autoescape=True, trim_blocks=True
    )
    style = HtmlFormatter().get_style_defs(".highlight")
    return environment.get_template(template).render(code_style=Markup(style), **values)
