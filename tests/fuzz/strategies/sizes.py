"""Sizes that no machine can do, or that take very long: they are refused before memory is taken."""

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case, Step
from tests.fuzz.steps import copy, write

_huge = st.integers(4, 12).map(lambda power: 10**power) | st.integers(12, 40).map(
    lambda power: 2**power
)
_POLICY = ("--policy", "greedy")
_GRID = 'scenario = "paper"\npolicies = ["greedy"]\nmissions = {}\nseed = 1\n[design]\n'


@st.composite
def sizes(draw: st.DrawFn) -> Case:
    """A huge number in one place."""
    n = draw(_huge)
    side = draw(st.sampled_from([10, 100, 1000]))
    values = f"[{', '.join(map(str, range(1, side + 1)))}]"
    fields = ("charge_start", "charge_complete", "flying_time", "quota")
    grid = 'kind = "grid"\n[design.values]\n' + "\n".join(f"{f} = {values}" for f in fields)
    sobol = f'kind = "saltelli"\nbase = {n}\nseed = 1\n[design.ranges]\nquota = [9, 99]'
    cube = f'kind = "latin-hypercube"\nsize = {n}\nseed = 1\n[design.ranges]\nquota = [1, 900]'
    study = _GRID.format(draw(st.sampled_from([1, 300, n]))) + draw(
        st.sampled_from([grid, sobol, cube])
    )
    fields = ("uavs", "grid", "max_slots", "quota", "communication_slots", "lanes", "flying_time")
    fields += ("arrivals.buffer", "charging.power", "failures.uav_repair", "wind.strength")
    config = draw(st.sampled_from(["hidden", "replay", "num_envs", "batch", "n_step", "ticks"]))
    nodes = f"nodes=[{','.join('[1,1]' for _ in range(min(n, 20_000)))}]"
    commands = (
        ("evaluate", *_POLICY, "--missions", str(n)),
        ("evaluate", *_POLICY, "--missions", str(n), "--engine", "events"),
        ("evaluate", *_POLICY, "--missions", "2", "--workers", str(max(n, 10**5))),
        ("simulate", "--set", f"{draw(st.sampled_from(fields))}={n}"),
        ("simulate", "--set", nodes),
        ("study", "run", "../in/big.toml", "--dry-run"),
        ("study", "run", "../in/big.toml", "--out", "../out/a"),
        ("studies", "show", "../in/big.toml"),
        ("sweep", "--set", f"quota=1..{n}", "--results", "../out/r", "--out", "../out/p"),
        ("sweep", "--set", f"arrival_rate=0..1:{n}", "--results", "../out/r", "--out", "../out/p"),
        ("train", "../in/big-training.toml", "--out", "../out/a"),
        ("study", "show", f"../in/{ready.RESULTS}", "--worst", str(n)),
        ("verify", f"../in/{ready.RESULTS}", "--missions", str(n)),
    )
    training = f"[{n}, {n}]" if config == "hidden" else str(n)
    steps: tuple[Step, ...] = (
        copy(ready.RESULTS, f"in/{ready.RESULTS}"),
        write("in/big.toml", study.encode()),
        write("in/big-training.toml", _training(config, training).encode()),
    )
    return Case("size", draw(st.sampled_from(commands)), steps, lasting=3)


def _training(field: str, value: str) -> str:
    ticks = value if field == "ticks" else "100"
    head = "" if field == "ticks" else f"{field} = {value}\n"
    return f'name = "big"\n{head}[[phases]]\nname = "only"\nticks = {ticks}\nbattery = true\n'


_MANY = st.integers(1, 3).map(lambda power: 10**power)
# Fields that make work, with values that a scenario may have.
_WORK = {
    "max_slots": st.integers(2, 5).map(lambda power: 10**power),
    "uavs": st.sampled_from([8, 32, 64]),
    "arrival_rate": st.sampled_from([0.0, 1e-9, 1.0, 100.0]),
    "arrivals.schedule": st.sampled_from(
        ["[[0, 100]]", "[[0, 0], [99, 100]]", "[[0, 0], [99999, 100]]", "[[0, 1e6]]", "[[5, 0.0]]"]
    ),
    "arrivals.service": st.sampled_from(['"newest"', '"oldest"']),
    "arrivals.buffer": st.sampled_from([1, 1000, 10**6]),
    "age.measured": st.just("true"),
    "communication_slots": st.sampled_from([1, 20, 64]),
    "initial_data": st.sampled_from([0, 10**3, 10**6]),
    "quota": st.sampled_from([1, 10**6]),
    "grid": st.sampled_from([16, 64, 256]),
    "nodes": _MANY.map(lambda n: str([[1 + i % 15, 1 + i // 15 % 15] for i in range(n)])),
    "charging.measured": st.just("true"),
    "failures": st.just("{uav_rate=0.5, uav_repair=1, node_rate=0.5, node_repair=1}"),
}


@st.composite
def work(draw: st.DrawFn) -> Case:
    """A scenario that may be valid and makes much work: it ends, or it is refused."""
    fields = draw(st.lists(st.sampled_from([*_WORK]), min_size=2, max_size=5, unique=True))
    settings = [f"--set={field}={draw(_WORK[field])}" for field in fields]
    if draw(st.booleans()):
        settings.append('--set=arrivals.process="continuous"')
    missions = ("--missions", str(draw(st.integers(0, 4).map(lambda power: 10**power))))
    policy = ("--policy", draw(st.sampled_from(["greedy", "random", "age", "planner"])))
    commands = (
        ("simulate", *policy),
        ("simulate", *policy, "--figure", "../out/a.png"),
        ("simulate", *policy, "--events", "../out/a.parquet"),
        ("evaluate", *policy, *missions),
        ("evaluate", *policy, *missions, "--engine", "events"),
        ("sweep", *policy, *missions, "--results", "../out/r", "--out", "../out/p"),
    )
    return Case("work", (*draw(st.sampled_from(commands)), *settings), lasting=4)
