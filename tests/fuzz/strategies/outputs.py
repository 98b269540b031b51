"""Outputs that cannot be written: devices, fifos, links, folders, full disks, names, rights."""

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case, Step
from tests.fuzz.steps import node, write
from tests.fuzz.strategies import commands
from tests.fuzz.strategies.changes import NODES

# Every parameter that writes, and questions, which keep results.
_WRITING = [
    (words, name)
    for words, parameters in commands.COMMANDS
    for name in (commands.name_of(words, parameter) for parameter in parameters)
    if name in commands.OUTPUTS
    or (*words, name) in (("sweep", "--results"), ("what-if", "--results"))
]
_PRINTING = (
    ("studies",),
    ("scenarios", "show", "paper", "--json"),
    ("study", "show", f"../in/{ready.RESULTS}"),
    ("evaluate", "--policy", "greedy", "--missions", "2", "--json"),
    ("--help",),
)
_NAMES = ("a" * 244, "a" * 256, "é" * 130, "-", " ", "a/b/c")
_NAMES += ("a\x00b", "a\nb", "a\udc80b", "a\x1bb")
_INSIDE = ("manifest.json", ".lock", ".index.lock", "index.html", "missions", "sweeps")
_INSIDE += ("checkpoint.safetensors", "sweeps/kept.toml", "sweeps/kept")


@st.composite
def outputs(draw: st.DrawFn) -> Case:
    """A command whose output meets something in its place."""
    steps: list[Step] = [*ready.INPUTS]
    if draw(st.integers(0, 4)) == 0:
        stdout = draw(st.sampled_from(["full", "closed"]))
        return Case("output", draw(st.sampled_from(_PRINTING)), tuple(steps), stdout=stdout)
    words, option = draw(st.sampled_from(_WRITING))
    ending = draw(st.sampled_from(commands.ENDINGS.get(option, ("",))))
    trouble = draw(st.sampled_from(["node", "node", "disk", "name", "inside", "above", "old"]))
    name, file_size = f"a{ending}", None
    if trouble == "node":
        steps.append(node(f"out/{name}", draw(st.sampled_from(NODES))))
    elif trouble == "disk":
        file_size = draw(st.sampled_from([512, 4096, 20_000]))
    elif trouble == "name":
        name = draw(st.sampled_from(_NAMES)) + ending
    elif trouble == "inside":
        inside = draw(st.sampled_from(_INSIDE))
        steps.append(node(f"out/{name}/{inside}", draw(st.sampled_from(NODES))))
    elif trouble == "above":
        steps.append(node("out/above", draw(st.sampled_from((*NODES, "locked")))))
        name = f"above/{name}"
    else:
        steps.append(write(f"out/{name}", b"an old file"))
    arguments = commands.line(words, {option: f"../out/{name}"})
    return Case("output", arguments, tuple(steps), file_size=file_size, lasting=10)
