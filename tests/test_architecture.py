"""The architecture: floors and rooms import downwards only."""

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FLOORS = ("dess", "policies", "analysis", "reports")  # from the ground up
# The rooms of a floor; each imports only from those before it.
ROOMS = {
    "dess": (
        *("base", "physics", "scenario"),
        *(
            "model.link",
            "model.state",
            "model.ways",
            "model.channel",
            "model.rules",
            "model.events",
        ),
        *(
            "model.record",
            "model.packets",
            "model.view",
            "model.guard",
            "model.reach",
            "model.campaign",
            "model.years",
            "model.batch",
        ),
        *("model.mission", "model.processes"),
        *("envs.observations", "envs", "envs.integrations"),
    ),
    "policies": (
        *("shipped", "network", "integers", "dense", "quantization"),
        *("adapter", "choices", "flight"),
        *("heuristics", "planner"),
        *("learner.config", "learner.description", "learner.policy"),
        *("learner.arrays", "learner.trained"),
        "learner.network",
        *("learner.calibration", "learner.training"),
        *("learner.dqn", "learner.ppo", "learner.checkpoint", "learner.session", "learner"),
        "registry",
    ),
    "analysis": (
        *(
            "numbers",
            "names",
            "metrics",
            "metric_ranges",
            "measured",
            "facts",
            "sheet",
            "weather",
            "stats",
            "tables",
            "bound",
            "study",
        ),
        "wasm",
        *("results", "flights", "execution", "figures"),
        *("answers.settings", "answers.fleet", "answers", "paper", "ask"),
    ),
    "reports": (
        *("pages", "player", "animation", "crate"),
        *("interrupts", "cli"),
    ),
}
# What only gathers the names of a floor, or begins the command.
FACADES = {"dess", "dess.__main__", "dess.api", *(f"dess.{floor}" for floor in FLOORS)}
# What a floor must not import, besides the floors above it.
REFUSED = {"dess": {"pandas"}, "policies": {"pandas"}}
# What only the learner may import: it takes seconds to load, and only trainings need it.
LEARNER, LEARNING = "dess.policies.learner", {"torch"}
# The libraries that only the classes made for them import; who uses these classes imports them.
INTEGRATIONS = "dess.envs.integrations"
FOREIGN = {"agilerl", "benchmarl", "pufferlib", "ray", "rliable", "sb3_contrib"}
FOREIGN |= {"stable_baselines3", "supersuit", "tensordict", "torchrl"}
# What a plain `dess --help` must not wait for.
HEAVY = {"torch", "numba", "numpy", "pandas", "pyarrow", "pydantic", "scipy", "matplotlib"}
HEAVY |= {"gymnasium"}
# The modules that let Python files of policies be run, which is code: commands, and functions of
# Python that take names from users. Others hand on what these say, or run no file.
RUN_FILES = {
    *("dess.policies", "dess.analysis.execution.evaluation", "dess.analysis.ask.question"),
    *("dess.reports.cli.evaluate", "dess.reports.cli.lists", "dess.reports.cli.simulate"),
}
# What decides it by what users have named: a study whose policies are typed, and what they confirm.
DECIDE = {
    "dess.analysis.study.files": {"'policies' in overrides"},
    "dess.analysis.study.study": {"_may_run_files(info.context)"},
    "dess.analysis.results.provenance": {"True", "run_files"},  # for confirmed teams alone
    "dess.reports.pages.verify": {
        f"is_confirmed({name}, sampling.named)" for name in ("name", "policy")
    },
    "dess.reports.cli.simulate": {"True", "bool(named)"},
    "dess.model.processes": {"isinstance(name, TypedProcess)"},
}
# The functions to which users give names, and the modules that use them.
MAY_RUN_FILES = {
    "dess.policies.load": set(),
    "dess.policies.load_team": {"dess.api"},  # what a user gives as a policy
    "dess.analysis.execution.evaluation.evaluate": {"dess.analysis"},
    "dess.model.processes.TypedProcess": {"dess.reports.cli.options"},
    **{
        f"dess.analysis.ask.question.{name}_question": {
            *("dess.analysis.ask.answer", "dess.reports.cli.ask"),
        }
        for name in ("sweep", "what_if")
    },
    **{f"dess.analysis.ask.answer.{name}": {"dess.analysis"} for name in ("sweep", "what_if")},
    **{f"dess.analysis.{name}": set() for name in ("evaluate", "sweep", "what_if")},
}


def module_name(path: Path) -> str:
    """The dotted name of a source file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
    return name if parts[0] == "dess" else f"dess.{name}"


def place_of(module: str) -> list[str]:
    """The floor of a module of ours, its room, and so on; without the name that all have."""
    parts = module.split(".")
    return parts[1:] if parts[0] == "dess" and parts[1:] and parts[1] in FLOORS else parts


TEXTS = {
    module_name(path): path.read_text("utf-8")
    for floor in FLOORS
    for path in sorted((ROOT / floor).rglob("*.py"))
}
SOURCES = {name: ast.parse(text, name) for name, text in TEXTS.items()}
# Notebooks document themselves in their cells.
LIBRARY = {name: tree for name, tree in SOURCES.items() if ".notebooks." not in name}
NOTEBOOKS = sorted((ROOT / "reports" / "notebooks").rglob("*.py"))
# Functions that simulate missions.
SIMULATING = {"simulate", "simulate_batch", "evaluate", "resimulate", "run_study"}
SIMULATING |= {"measure_decision_times", "mission_of", "sweep", "what_if"}
ASKING = {"what_if", "sweep", "own_sea"}  # the notebooks that ask, and so simulate


@cache
def imports_of(name: str) -> set[str]:
    """The modules that a module imports, anywhere in it; its own package's in full."""
    found = set()
    for node in ast.walk(SOURCES[name]):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}:{node.lineno}: a relative import"
            modules = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {m if m in SOURCES else str(node.module) for m in modules}
    return found


def loaded_by(script: str) -> set[str]:
    """The packages that a new interpreter has loaded after a script."""
    script += "\nimport json, sys; print(); print(json.dumps(list(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return {name.split(".")[0] for name in json.loads(done.stdout.splitlines()[-1])}


def public(tree: ast.Module | ast.ClassDef) -> Iterator[ast.ClassDef | ast.FunctionDef]:
    """The public classes and functions of a module, and the public methods of these classes."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from public(node)


@pytest.mark.parametrize("floor", FLOORS)
def test_imports_only_go_downwards(floor):
    refused = {*FLOORS[FLOORS.index(floor) + 1 :], *REFUSED.get(floor, ())}
    climbing = {
        f"{name} imports {imported}"
        for name in SOURCES.keys() - FACADES
        if place_of(name)[0] == floor
        for imported in imports_of(name)
        if place_of(imported)[0] in refused
    }
    assert not climbing


@pytest.mark.parametrize("floor", ROOMS)
def test_rooms_only_import_from_rooms_before_them(floor):
    rooms = ROOMS[floor]

    def place(module: str) -> int:
        """Of the room of a module: the smallest one that it is in."""
        parts = place_of(module)[1:]
        names = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
        return rooms.index(next(name for name in names if name in rooms))

    inside = {name for name in LIBRARY if place_of(name)[0] == floor} - FACADES
    climbing = {
        f"{name} imports {imported}"
        for name in inside
        for imported in imports_of(name) & inside
        if place(imported) > place(name)
    }
    assert not climbing


def test_no_modules_import_each_other():
    graph = {name: imports_of(name) & set(SOURCES) for name in SOURCES}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"a cycle of imports: {' -> '.join(error.args[1])}")


def users_of(libraries: set[str]) -> set[str]:
    """The modules that import one of some libraries."""
    return {n for n in SOURCES if libraries & {module.split(".")[0] for module in imports_of(n)}}


def users_of_name(module: str, name: str) -> set[str]:
    """The modules that take a name from a module, beside that module itself."""
    return {user for user in LIBRARY if user != module and _takes(LIBRARY[user], module, name)}


@cache
def imports_and_attributes(tree: ast.Module) -> tuple[list[ast.Import | ast.ImportFrom], set[str]]:
    """The imports in a source, and the attributes that it takes, in its words."""
    nodes = [*ast.walk(tree)]
    attributes = {ast.unparse(node) for node in nodes if isinstance(node, ast.Attribute)}
    return [n for n in nodes if isinstance(n, ast.Import | ast.ImportFrom)], attributes


def _takes(tree: ast.Module, module: str, name: str) -> bool:
    """Whether a source imports a name of a module, or takes it as an attribute of the module."""
    imports, attributes = imports_and_attributes(tree)
    of_module = {module}
    for node in imports:
        if isinstance(node, ast.ImportFrom):
            imported = {f"{node.module}.{alias.name}": alias for alias in node.names}
            if {f"{module}.{name}", f"{module}.*"} & imported.keys():
                return True
        else:
            imported = {alias.name: alias for alias in node.names if alias.asname}
        if module in imported:
            of_module.add(imported[module].asname or imported[module].name)
    return any(f"{of}.{name}" in attributes for of in of_module)


def run_files_in(name: str) -> set[str]:
    """What a module passes as ``run_files``, in its words."""
    calls = (node for node in ast.walk(LIBRARY[name]) if isinstance(node, ast.Call))
    words = (word for call in calls for word in call.keywords if word.arg == "run_files")
    return {ast.unparse(word.value) for word in words}


def test_only_commands_and_public_functions_let_python_files_be_run():
    """All other modules load policies by plain names, or hand on what they were told."""
    handed_on = {"run_files", "self.run_files", "study.run_files", "self.study.run_files"}
    for name in LIBRARY:
        allowed = DECIDE.get(name, {"True"} if name in RUN_FILES else set())
        assert run_files_in(name) <= allowed | handed_on, name


@pytest.mark.parametrize("door", MAY_RUN_FILES)
def test_only_words_of_the_user_can_name_a_python_file(door):
    """All other modules load policies by plain names, for which no file is run.

    The cells of notebooks are the user's own words.
    """
    module, _, name = door.rpartition(".")
    assert users_of_name(module, name) == MAY_RUN_FILES[door]


@pytest.mark.parametrize(
    ("libraries", "owners"),
    [(LEARNING, (f"{LEARNER}.", INTEGRATIONS)), (FOREIGN, (f"{INTEGRATIONS}.",))],
    ids=["learning", "integrations"],
)
def test_libraries_are_imported_by_their_owners_alone(libraries, owners):
    """And the modules of integrations by nobody."""
    users = users_of(libraries)
    assert users and all(name.startswith(owners) for name in users)
    for name in SOURCES:
        of_integrations = {m for m in imports_of(name) if m.startswith(INTEGRATIONS)}
        assert not of_integrations or name.startswith(INTEGRATIONS), name


def test_the_command_line_loads_nothing_heavy():
    assert not HEAVY & loaded_by("from dess.reports.cli import main; main(['--help'])")


@pytest.mark.slow
@pytest.mark.brief
def test_torch_is_loaded_only_for_trainings():
    script = "import dess.policies, dess.analysis; from dess.reports.cli import main\n"
    script += (
        "dess.policies.load_team('greedy,generalist,ddqn,ddqn-paper'), dess.policies.names()\n"
    )
    script += "for line in ('policies', 'evaluate --policy ddqn --missions 1'):\n"
    script += "    assert main(line.split()) == 0\n"
    assert not LEARNING & loaded_by(script + "assert main(['train', 'none', '--out', 'none']) == 2")


@pytest.mark.parametrize("package", ["dess", "dess.policies", "dess.analysis"])
def test_packages_list_their_public_names(package):
    module = import_module(package)
    assert dir(module) == sorted(module.__all__)
    assert all(getattr(module, name) is not None for name in dir(module))


@pytest.mark.parametrize("name", LIBRARY)
def test_what_is_public_is_documented(name):
    tree = LIBRARY[name]
    assert ast.get_docstring(tree), "the module has no docstring"
    silent = [f"{node.name}:{node.lineno}" for node in public(tree) if not ast.get_docstring(node)]
    assert not silent


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_only_notebooks_that_ask_simulate_missions(path):
    nodes = [*ast.walk(ast.parse(path.read_text("utf-8")))]
    imported = {alias.name for n in nodes if isinstance(n, ast.ImportFrom) for alias in n.names}
    used = {n.attr for n in nodes if isinstance(n, ast.Attribute)} | imported
    assert bool(SIMULATING & used) == (path.stem in ASKING)
