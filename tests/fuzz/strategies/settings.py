"""Settings that do not fit: odd numbers in every field, duplicates in designs, other metrics."""

from hypothesis import strategies as st

from dess.analysis.metrics import metric_group
from tests.fuzz import ready
from tests.fuzz.case import Case
from tests.fuzz.steps import write
from tests.fuzz.strategies.commands import line
from tests.fuzz.strategies.sections import PLAIN, odd_numbers
from tests.fuzz.strategies.values import numbers, toml_values

_COMMANDS = (("simulate",), ("evaluate",), ("scenarios", "show"), ("sweep",))
# Values of a field that are equal, or of no field at all.
_DUPLICATES = (
    ("uavs", "1, 1"),
    ("uavs", "1, 1.0"),
    ("uavs", "true, 1"),
    ("arrival_rate", "0.0, -0.0"),
    ("arrival_rate", "0, 0.0"),
    ("initial_data", "[5, 7], [5.0, 7.0]"),
    ("initial_data", "[0.0, 7], [-0.0, 7]"),
    ('"failures.uav_rate"', "0.0, -0.0"),
    ('"arrivals.process"', '"continuous", "continuous"'),
)
_SWEPT = ("uavs=1,1.0", "arrival_rate=0.0,-0.0", "uavs=2,2", "arrival_rate=0,0.0")
# What the small sea does not measure, what has no price, and amounts of no use.
_UNFIT = (
    *[{"--metric": metric} for metric in (*metric_group("operations"), "cost", "x" * 5000)],
    *[{"--require": text} for text in ("age=1", "success=2", "success=nan", "x=1", "cost=5")],
    *[{"--price": text} for text in ("uav=-1", "uav=nan", f"currency={'x' * 4000}", "x=1")],
    *[{"--name": name} for name in ("../a", "a/b", ".", "", "a" * 300)],
    *[{"--policy": text} for text in ("greedy,greedy", "greedy,", "../in/none.py:A")],
    *[{"--set": f"uavs={text}"} for text in ("2..1", "1..2:0", "1..1e9", "..", "1,,2")],
)


@st.composite
def odd_fields(draw: st.DrawFn) -> Case:
    """A scenario with an odd number in one of its fields."""
    words = draw(st.sampled_from(_COMMANDS))
    name = "scenarios show name" if words == ("scenarios", "show") else "--scenario"
    file = draw(st.sampled_from([ready.SCENARIO, ready.SECTIONS]))
    settings = [draw(odd_numbers), *draw(st.lists(st.sampled_from(PLAIN), max_size=1))]
    arguments = line(words, {name: f"../in/{file}"})
    options = tuple(f"--set={setting}" for setting in settings[::-1])
    return Case("odd field", (*arguments, *options), ready.INPUTS, lasting=3)


@st.composite
def duplicates(draw: st.DrawFn) -> Case:
    """A design that has a point twice; it has to be refused."""
    if draw(st.booleans()):
        values = {"--set": draw(st.sampled_from(_SWEPT))}
        return Case("duplicate", line(("sweep",), values), ready.INPUTS, code=2)
    field, values = draw(st.sampled_from(_DUPLICATES))
    kind = draw(st.sampled_from(["grid", "one-at-a-time"]))
    text = f'scenario = "{ready.SECTIONS}"\npolicies = ["greedy"]\nmissions = 1\n'
    text += f'[design]\nkind = "{kind}"\nvalues.{field} = [{values}]\n'
    arguments = ("study", "run", "../in/twice.toml", "--dry-run")
    return Case(
        "duplicate", arguments, (*ready.INPUTS, write("in/twice.toml", text.encode())), code=2
    )


@st.composite
def unfit(draw: st.DrawFn) -> Case:
    """A sweep that is asked for what it cannot have; it is refused before its first mission."""
    if draw(st.booleans()):
        return Case("unfit", line(("sweep",), draw(st.sampled_from(_UNFIT))), ready.INPUTS, code=2)
    option = draw(st.sampled_from(["--price", "--require"]))
    key = draw(st.sampled_from(["uav", "pad", "hour", "missions", "slot_seconds", "success"]))
    values = {option: f"{key}={draw(numbers | toml_values)}"}
    return Case("unfit", line(("sweep",), values), ready.INPUTS, lasting=5)
