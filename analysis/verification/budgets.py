"""Checks that data are neither created nor lost, and that batteries follow their rules."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.results.files import MANIFEST
from analysis.results.tables import Results, load_results
from analysis.verification.checks import CONSERVATION, ENERGY, Check
from analysis.verification.logs import Log
from dess import InputError

EPSILON = np.finfo(float).eps

_KEPT = "initial + arrived = collected + residual"


def studies_in(folder: Path, *, but: str = "") -> tuple[dict[str, Results], list[str]]:
    """The results of all studies in a folder, and the names of those that cannot be loaded.

    Args:
        folder: A folder that contains a results folder per study.
        but: A study to leave out.
    """
    loaded, damaged = {}, []
    for path in sorted(folder.glob(f"*/{MANIFEST}")):
        name = path.parent.name
        if name != but:
            try:
                loaded[name] = load_results(path.parent)
            except InputError:
                damaged.append(name)
    return loaded, damaged


def conservation_check(studies: Mapping[str, Results]) -> Check:
    """Check in every mission of every study that data are neither created nor lost.

    Every addition rounds its result, which is at most the total amount of data, by at most half a
    unit in the last place. So the number of additions gives a bound of the rounding error. The
    check reports the mission that comes closest to its bound.

    Args:
        studies: Results by the name of their study.
    """
    tables = [_imbalances(results) for results in studies.values()]
    table = pd.concat(tables, ignore_index=True)
    error, bound = table.loc[(table["error"] / table["bound"]).idxmax()]
    seen = f"off by {error:.1e} of the data at most, {error / EPSILON:.0f} units of rounding"
    some = f"{len(studies)} studies" if len(studies) > 1 else f"the study {next(iter(studies))}"
    test = f"Every mission of {some}"
    return Check.exact(CONSERVATION, test, _KEPT, seen, len(table), error, float(bound))


def _imbalances(results: Results) -> pd.DataFrame:
    """A row per mission: ``error``, as a share of its data, and the ``bound`` of rounding."""
    missions = pd.concat([results.missions, results.checks])
    spaces = [results.scenario(point) for point in range(len(results.manifest["points"]))]
    m = missions["point"].map([space.communication_slots for space in spaces].__getitem__)
    nodes = missions["point"].map([len(space.nodes) for space in spaces].__getitem__)
    whole = missions["initial"] + missions["arrived"]
    error = (whole - missions["collected"] - missions["residual"]).abs()
    # Two additions per communication (node and mission), then arrivals and nodes.
    additions = 2 * m * missions["uav_slots"] + 2 * nodes * (missions["slots"] + 1)
    return pd.DataFrame(
        {"error": error / whole.where(whole > 0, 1.0), "bound": EPSILON * additions}
    )


def balance_check(logs: Sequence[Log]) -> Check:
    """Check at every node, bit for bit, that initial + arrived = collected + residual data."""
    off = max((float(np.abs(log.residuals[-1] - log.left).max()) for log in logs), default=0.0)
    lowest = min((float(log.residuals.min()) for log in logs), default=0.0)
    lowest, n = min(lowest, 0.0), sum(log.left.size for log in logs)
    seen = f"off by {off:g} data units at most, never below {lowest:g}"
    return Check.exact(CONSERVATION, "Every node of every log", _KEPT, seen, n, max(off, -lowest))


def battery_check(logs: Sequence[Log]) -> Check:
    """Check that the battery follows its rules (eq. 1-4, 8) in every UAV slot of the logs."""
    wrong = np.concatenate([np.zeros(0, bool), *map(battery_errors, logs)])
    cost, gain = (
        "/".join(map(str, sorted({getattr(log.scenario, field) for log in logs})))
        for field in ("flight_cost", "charge_rate")
    )
    known = f"−{cost} % flying, +{gain} % charging; charging begins at or below C_S, ends at C_C"
    test = "Battery of every UAV in every slot"
    return Check.counted(ENERGY, test, known, int(wrong.sum()), wrong.size)


def battery_errors(log: Log) -> np.ndarray:
    """For each of the N UAV slots of a log, whether it breaks a rule of the battery."""
    s, table = log.scenario, log.uav_slots
    before = table.groupby("uav")["battery"].shift().fillna(s.flying_time)
    charging = table["charging"]
    begins = charging & ~charging.groupby(table["uav"]).shift(fill_value=False)
    last = table["slot"] == s.max_slots - 1
    ends = charging & ~charging.groupby(table["uav"]).shift(-1, fill_value=False) & ~last
    x, y, width, height = s.zone
    parked = table["x"].between(x, x + width - 1) & table["y"].between(y, y + height - 1)
    charged = (before + s.charge_rate).clip(upper=s.charge_complete)
    right = np.where(charging, charged, before - s.flight_cost) == table["battery"]
    right &= ~charging | (parked & ~table["moved"])
    right &= ~begins | (before <= s.charge_start)
    right &= ~ends | (table["battery"] == s.charge_complete)
    return (~right).to_numpy()
