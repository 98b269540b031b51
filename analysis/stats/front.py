"""The Pareto front of cost against a metric, and the probability that a setting is on it.

    on_front(costs, values)  # of known means
    membership(costs, values, share=True, generator=np.random.default_rng(1))  # of samples

A setting is on the front if no other one is dominating it: at most as costly and at least as good,
and one of both strictly.
"""

import numpy as np

_BATCH = 2**21  # weights at a time: some megabytes, whatever n


def on_front(costs: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Which settings are on the front.

    Args:
        costs: (..., k) costs of the settings: less is better.
        values: (..., k) values of the metric: more is better.

    Returns:
        (..., k) booleans. Settings that are alike in both are on the front together, or not at all.
    """
    order = np.lexsort((-values, costs), axis=-1)
    cost, value = (np.take_along_axis(of, order, -1) for of in (costs, values))
    best_before = np.full_like(value, -np.inf)
    best_before[..., 1:] = np.maximum.accumulate(value, axis=-1)[..., :-1]
    # Of those alike, which are neighbours now, the first one decides.
    alike = np.zeros(value.shape, bool)
    alike[..., 1:] = (np.diff(cost) == 0) & (np.diff(value) == 0)
    first = np.maximum.accumulate(np.where(alike, 0, np.arange(value.shape[-1])), axis=-1)
    members = np.zeros(value.shape, bool)
    is_member = np.take_along_axis(value > best_before, first, -1)
    np.put_along_axis(members, order, is_member, -1)
    return members


def membership(
    costs: np.ndarray,
    values: np.ndarray,
    share: bool,
    generator: np.random.Generator,
    draws: int = 1000,
) -> np.ndarray:
    """The probability that each setting is on the front, given the missions.

    The Bayesian bootstrap of D. B. Rubin (Annals of Statistics 9 (1981) 130-134): the missions get
    weights from Dirichlet's distribution, the same for all settings, so that what common random
    numbers let settings have in common stays in common. Failures may be so rare that a sample has
    none. So each setting has half a success and half a failure more, of weights of its own: the
    share of a single setting has its posterior distribution under the prior of Jeffreys.

    Over 3,000 planted problems of each of three kinds, whose true means were drawn independently,
    stated and true shares of membership differed by 0.005 on average, and by 0.06 at most in any
    bin of probabilities. Nothing is assumed of how a metric depends on the fleet: where each
    costlier setting is truly better, by less than the missions can show, they are too low.

    Args:
        costs: (k, n) costs; entry r of every setting belongs to the same replication, nan where a
            setting does not have it.
        values: (k, n) values of the metric, nan at the same places.
        share: Whether the metric is an outcome 0 or 1.
        generator: Draws the weights.
        draws: How many fronts are drawn.

    Returns:
        (k,) shares of the fronts that have the setting.
    """
    present = ~np.isnan(values)
    count = np.zeros(len(values))
    # Less the first one, equal costs stay equal, without rounding errors.
    base = np.array([row[there][0] for row, there in zip(costs, present, strict=True)])
    excess = np.where(present, costs - base[:, None], 0.0)
    known, mask = np.where(present, values, 0.0), present.astype(float)
    batch = max(1, _BATCH // values.shape[1])
    for begin in range(0, draws, batch):
        size = min(batch, draws - begin)
        weights = generator.standard_exponential((size, values.shape[1]))
        # Not matrix products: their last bits would depend on the number of threads.
        total, cost, value = (np.einsum("bn,kn->bk", weights, of) for of in (mask, excess, known))
        more = (
            generator.standard_gamma(0.5, (2, size, len(values))) if share else np.zeros((2, 1, 1))
        )
        count += on_front(base + cost / total, (value + more[0]) / (total + more.sum(axis=0))).sum(
            axis=0
        )
    return count / draws
