"""Checks of the channel: single UAVs against closed forms, and communications computed again.

The checks use only one part of the simulator, the generator of random words, run as plain Python.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import special, stats

from analysis.numbers import minus
from analysis.verification import closed_forms
from analysis.verification.checks import CHANNEL, Check
from analysis.verification.logs import Log
from dess import streams
from dess.sections.fleet import type_of

# Units in the last place by which two ways to compute a rate may differ. Each has few steps, and
# the conversion of the SNR from dB to a ratio increases the rounding error most.
_ROUNDINGS = 1000
_COMMUNICATIONS = ["node", "value", "best", "known", "residual"]


def rate_check(rates: pd.DataFrame) -> Check:
    """Compare the mean rates of ``lone_uav.rates`` with the integral over all shadowing."""
    test = "Mean rate of a lone UAV at each distance: chi-square"
    known, n = "E[δ log₂(1 + SNR)] by integration", int(rates["n"].sum())
    off = float((rates["mean"] / rates["known"] - 1).abs().max())
    seen = f"within {100 * off:.2g} % at {len(rates)} distances"
    if not (rates["error"] > 0).all():  # without shadowing, nothing is random
        return Check.exact(CHANNEL, test, known, seen, n, off, bound=1e-9)
    square = (((rates["mean"] - rates["known"]) / rates["error"]) ** 2).sum()
    return Check(CHANNEL, test, known, seen, n, float(stats.chi2.sf(square, len(rates))))


def shadowing_checks(deviates: np.ndarray) -> list[Check]:
    """Compare the shadowing of ``lone_uav.deviates`` with independent standard normal variables."""
    n, test = deviates.size, "Correlation of a communication slot and the next"
    mean, deviation = (minus(f"{value:.3f}") for value in (deviates.mean(), deviates.std()))
    seen = f"mean {mean}, deviation {deviation}"
    p = float(stats.kstest(deviates, stats.norm.cdf).pvalue)
    correlation = float((deviates[1:] * deviates[:-1]).mean())
    return [
        Check(CHANNEL, "Shadowing of a lone UAV: Kolmogorov-Smirnov", "N(0, 1)", seen, n, p),
        Check.normal(CHANNEL, test, 0, correlation, 1 / np.sqrt(n - 1), n - 1),
    ]


def communication_checks(logs: Sequence[Log], seed: int) -> list[Check]:
    """Check the served node and the amount of data of every communication in the logs.

    Both are computed again from the formula, with the shadowing of that communication slot: the
    node with the highest SNR of those with data, and the smaller of its rate and its data.
    """
    tables = [communications(log, seed) for log in logs]
    table = pd.concat(tables) if tables else pd.DataFrame(columns=_COMMUNICATIONS, dtype=float)
    same = table[table["node"] == table["best"]]
    off = float((same["value"] / same["known"] - 1).abs().max()) if len(same) else 0.0
    emptied = int((same["known"] == same["residual"]).sum())
    seen = f"off by {off:.1e} of it at most; {emptied:,} times the node was emptied"
    test, known = "Node served in a communication slot", "the best SNR among nodes with data"
    choice = Check.counted(CHANNEL, test, known, len(table) - len(same), len(table))
    test, known = "Data of a communication", "min(R, D) with the shadowing that was drawn"
    bound = _ROUNDINGS * np.finfo(float).eps
    return [choice, Check.exact(CHANNEL, test, known, seen, len(same), off, bound)]


def communications(log: Log, seed: int) -> pd.DataFrame:
    """Compute every communication of a log again.

    Returns:
        A row per communication: ``node`` and ``value`` as logged; ``best``, the node with the
        highest SNR of those with data; ``known``, the smaller of its rate and its ``residual``
        [data units].
    """
    scenario, m = log.scenario, log.scenario.communication_slots
    served = log.events["event"] == "communication"
    rows = log.events[served]
    slot = np.ceil(rows["time"]).to_numpy(np.int64) - 1
    number = np.rint((rows["time"] - slot) * m).to_numpy(np.int64) - 1
    offset = rows[["x", "y"]].to_numpy()[:, None] - np.array(scenario.nodes)
    distance = closed_forms.distance(scenario, offset[..., 0], offset[..., 1])
    eta = _shadowing(seed, log, rows["uav"].to_numpy(np.int64), slot, number)
    snr = closed_forms.mean_snr(scenario, distance) + eta
    residual = log.residuals[served.to_numpy()]
    best = np.where(residual > 0, snr, -np.inf).argmax(1)
    row = np.arange(len(rows))
    factor = rows["uav"].map(lambda i: type_of(scenario.fleet, int(i)).rate).to_numpy()
    rate = factor * closed_forms.rate(scenario, snr[row, best])
    left = residual[row, best]
    columns = (rows["node"].array, rows["value"].array, best, np.minimum(rate, left), left)
    return pd.DataFrame(dict(zip(_COMMUNICATIONS, columns, strict=True)))


def _shadowing(seed: int, log: Log, uav: np.ndarray, slot: np.ndarray, n: np.ndarray) -> np.ndarray:
    """The (E, K) shadowing [dB] of communication slots ``n`` = 0..m-1, for all nodes.

    Four communication slots share a block of four random words. One counter word of the generator
    is made of the UAV and the number of this group of four slots.
    """
    block = (n // 4 * 65536 + uav).astype(np.uint64)
    lane = (np.uint64(streams.SHADOWING) << np.uint64(24)) | block
    key, mask, half = np.uint64(seed), np.uint64(2**32 - 1), np.uint64(32)
    words = streams.philox.py_func(
        np.arange(len(log.scenario.nodes), dtype=np.uint64)[None, :],
        slot.astype(np.uint64)[:, None],
        lane[:, None],
        np.uint64(log.replication),
        key & mask,
        key >> half,
    )
    word = np.choose(n[:, None] % 4, words)
    deviates = special.ndtri((word.astype(float) + 0.5) / 2.0**32)
    return np.sqrt(log.scenario.shadowing_variance) * deviates
