"""Folders of policies and of trainings that a stranger sends: their JSON, tensors and headers."""

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case, Step
from tests.fuzz.steps import Bytes, Copy, Header, Json, Node, Plant, Sealed, Write
from tests.fuzz.strategies.folders import NODES
from tests.fuzz.strategies.values import byte_edits, json_edits, json_values

_FILES = ("model.safetensors", "config.json", "checkpoint.safetensors", "training.parquet")
_PLANTED = ("model.py", "policy.py", "config.py", "torch.py", "safetensors.py", "__init__.py")


_BAD = [b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f", b"\xff\xff\x7f\x7f"]  # NaN, infinity, huge


def _commands(folder: str) -> dict[str, tuple[tuple[str, ...], ...]]:
    policy = ("--policy", folder, "--scenario", f"../in/{ready.SCENARIO}")
    using = (
        ("evaluate", *policy, "--missions", "2"),
        ("simulate", *policy, "--json"),
        ("policies", "show", folder),
    )
    resuming = (("train", f"../in/{ready.TRAINING}", "--out", folder, "--resume"),)
    return {"in": using, "out": resuming}


def _changes(folder: str, tensors: str) -> st.SearchStrategy[Step]:
    """Changes of the folder of a training, above all of one of its files with tensors."""
    config, main = st.just(f"{folder}/config.json"), st.just(f"{folder}/{tensors}")
    paths = st.sampled_from([f"{folder}/{name}" for name in _FILES])
    values = st.tuples(st.tuples(st.integers(10**4, 10**7), st.sampled_from(_BAD)))
    inner = st.sampled_from([True, True, False])
    headers = st.builds(Header, main, json_edits(), inner)
    return st.one_of(
        *(headers, headers),
        st.builds(Json, config, json_edits()),
        st.builds(Bytes, main, values),
        st.builds(Bytes, paths, byte_edits()),
        st.builds(Write, paths, json_values.map(lambda text: text.encode("utf-8", "replace"))),
        st.builds(Node, paths, st.sampled_from(NODES)),
        st.just(Plant(folder, _PLANTED)),
    )


def _cases(place: str, tensors: str) -> st.SearchStrategy[Case]:
    folder = f"{place}/{ready.POLICY}"
    inputs = [Copy(name, f"in/{name}") for name in (ready.SCENARIO, ready.TRAINING)]
    inputs.append(Copy(ready.POLICY, folder))
    commands = st.sampled_from(_commands(f"../{folder}")[place])
    seals = st.sampled_from([(), (Sealed(folder),)])

    def case(line: tuple[str, ...], change: Step, seal: tuple[Step, ...]) -> Case:
        return Case("training", line, (*inputs, change, *seal), lasting=10)

    return st.builds(case, commands, _changes(folder, tensors), seals)


# A changed folder of a training: used as a policy, or continued.
trainings = _cases("in", "model.safetensors") | _cases("out", "checkpoint.safetensors")
