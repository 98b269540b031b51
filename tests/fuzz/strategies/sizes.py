"""Sizes that no machine can do, or that take very long: they are refused before memory is taken."""

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case, Step
from tests.fuzz.steps import Copy, Write

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
        Copy(ready.RESULTS, f"in/{ready.RESULTS}"),
        Write("in/big.toml", study.encode()),
        Write("in/big-training.toml", _training(config, training).encode()),
    )
    return Case("size", draw(st.sampled_from(commands)), steps, lasting=3)


def _training(field: str, value: str) -> str:
    ticks = value if field == "ticks" else "100"
    head = "" if field == "ticks" else f"{field} = {value}\n"
    return f'name = "big"\n{head}[[phases]]\nname = "only"\nticks = {ticks}\nbattery = true\n'
