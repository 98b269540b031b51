"""How many small faults, planted one at a time in the product, the tests catch.

``python benchmarks/mutants.py`` runs the tests once and notes which test runs which line (this
needs pytest-cov), draws mutants, and runs for each of them the fastest tests that run its line. It
changes files of the working tree and restores them, so the tree must be without changes. Compiled
functions are left out, as a mutant of them would be compiled for minutes, and so are notebooks,
which run in processes of their own.
"""

import argparse
import ast
import json
import random
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

PACKAGES = ("dess", "policies", "analysis", "reports")
COMPILED = {"kernel", "inlined", "extension", "for_sections", "njit"}
SWAPPED = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.In: ast.NotIn, ast.NotIn: ast.In,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.And: ast.Or, ast.Or: ast.And,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
NOTES = Path(".mutants")  # what the run of all tests noted
SECONDS = 30.0  # of tests for each mutant
DURATIONS: dict[str, float] = {}


def pytest_runtest_logreport(report) -> None:
    """Note how long a test takes; this module is a plugin of the run of all tests."""
    DURATIONS[report.nodeid] = DURATIONS.get(report.nodeid, 0.0) + report.duration


def pytest_sessionfinish(session) -> None:
    """Write the durations, in the process that hears of all tests."""
    if not hasattr(session.config, "workerinput"):
        NOTES.with_suffix(".json").write_text(json.dumps(DURATIONS), "utf-8")


@dataclass(frozen=True)
class Mutant:
    """A part of a file, and what stands there in the mutant."""

    file: str
    line: int
    start: int
    end: int
    was: str
    text: str

    def planted(self, source: bytes) -> bytes:
        """The file with the fault."""
        return source[: self.start] + self.text.encode() + source[self.end :]


def changes_of(node: ast.AST) -> Iterator[ast.AST]:
    """What a mutant has in place of a node."""
    match node:
        case ast.Compare(ops=[operator]) if type(operator) in SWAPPED:
            yield ast.Compare(node.left, [SWAPPED[type(operator)]()], node.comparators)
        case ast.BoolOp():
            yield ast.BoolOp(SWAPPED[type(node.op)](), node.values)
        case ast.BinOp() if type(node.op) in SWAPPED:
            yield ast.BinOp(node.left, SWAPPED[type(node.op)](), node.right)
        case ast.UnaryOp(op=ast.Not() | ast.USub()):
            yield node.operand
        case ast.Constant(value=bool()):
            yield ast.Constant(not node.value)
        case ast.Constant(value=int() | float()):
            yield ast.Constant(node.value + 1)
        case ast.IfExp():
            yield ast.IfExp(node.test, node.orelse, node.body)
        case ast.Return(value=ast.expr()):
            yield ast.Return(ast.Constant(None))
        case ast.Expr(value=ast.Call()):
            yield ast.Pass()


def nodes_of(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that may change: not those of compiled functions and of types of arguments."""
    for child in ast.iter_child_nodes(node):
        decorators = {ast.unparse(d).split("(")[0] for d in getattr(child, "decorator_list", [])}
        if decorators & COMPILED or isinstance(child, ast.arg | ast.JoinedStr):
            continue
        yield child
        yield from nodes_of(child)


def mutants_of(file: str) -> list[Mutant]:
    """All mutants of a file."""
    source = Path(file).read_bytes()
    lines = source.splitlines(keepends=True)
    starts = [sum(map(len, lines[:n])) for n in range(len(lines))]
    mutants = []
    for node in nodes_of(ast.parse(source)):
        for change in changes_of(node):
            start = starts[node.lineno - 1] + node.col_offset
            end = starts[node.end_lineno - 1] + node.end_col_offset
            text = ast.unparse(ast.fix_missing_locations(change))
            text = f"({text})" if isinstance(node, ast.expr) else text
            was = source[start:end].decode()
            mutants.append(Mutant(file, node.lineno, start, end, was, text))
    return mutants


def note_tests() -> None:
    """Run all tests once, and note their lines and durations."""
    config = NOTES.with_suffix(".ini")
    included = ", ".join(f"{package}/*" for package in PACKAGES)
    config.write_text(f"[run]\ninclude = {included}\ndata_file = {NOTES}.coverage\n", "utf-8")
    coverage = ("--cov", f"--cov-config={config}", "--cov-context=test", "--cov-report=")
    side_by_side = ("-n", "2", "--dist", "loadfile")
    run_tests("-p", "benchmarks.mutants", *coverage, *side_by_side)


def run_tests(*options: str, timeout: float | None = None) -> int:
    """Run pytest in a process of its own, and return its exit status; 1 if it takes too long."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options]
    try:
        return subprocess.run(command, stdout=subprocess.DEVNULL, timeout=timeout).returncode
    except subprocess.TimeoutExpired:
        return 1


class Noted:
    """Which tests run a line, and how long they take."""

    def __init__(self) -> None:
        from coverage import CoverageData

        self.data = CoverageData(f"{NOTES}.coverage")
        self.data.read()
        self.durations = json.loads(NOTES.with_suffix(".json").read_text("utf-8"))

    def tests(self, mutant: Mutant) -> list[str]:
        """The fastest tests that run a mutant's line or, where none does, one of its file's."""
        lines = self.data.contexts_by_lineno(str(Path(mutant.file).resolve()))
        contexts = set(lines.get(mutant.line, ())) - {""}
        contexts = contexts or {context for line in lines.values() for context in line} - {""}
        tests = {context.rpartition("|")[0] for context in contexts}
        seconds, chosen = 0.0, []
        for test in sorted(tests, key=lambda test: self.durations.get(test, 0.0)):
            seconds += self.durations.get(test, 0.0)
            if chosen and seconds > SECONDS:
                break
            chosen.append(test)
        return chosen


def is_caught(mutant: Mutant, tests: list[str]) -> bool:
    """Whether one of the tests fails while the fault is planted."""
    if not tests:
        return False
    file = Path(mutant.file)
    source = file.read_bytes()
    chosen = NOTES.with_suffix(".txt")
    chosen.write_text("\n".join(tests), "utf-8")
    try:
        file.write_bytes(mutant.planted(source))
        return run_tests("-x", f"@{chosen}", timeout=20 * SECONDS) not in (0, 5)
    finally:
        file.write_bytes(source)


def main() -> None:
    """Draw mutants, try them, and print the share that is caught."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=28)
    parser.add_argument("--mutants", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("mutants.csv"))
    parser.add_argument("--noted", action="store_true", help="the tests have been noted before")
    options = parser.parse_args()
    if not options.noted:
        note_tests()
    noted = Noted()
    listed = ["git", "ls-files", *(f"{package}/**.py" for package in PACKAGES)]
    files = subprocess.run(listed, capture_output=True, text=True, check=True).stdout.split()
    mutants = [m for f in files if "notebooks" not in f for m in mutants_of(f)]
    drawn = random.Random(options.seed).sample(mutants, options.mutants)
    rows = []
    for mutant in drawn:
        tests = noted.tests(mutant)
        caught = is_caught(mutant, tests)
        place = {"file": mutant.file, "line": mutant.line, "was": mutant.was, "is": mutant.text}
        rows.append({**place, "tests": len(tests), "caught": caught})
        frame = pd.DataFrame(rows)
        frame.to_csv(options.out, index=False)
        print(
            len(frame), f"{frame.caught.mean():.1%}", mutant.file, mutant.line, caught, flush=True
        )


if __name__ == "__main__":
    main()
