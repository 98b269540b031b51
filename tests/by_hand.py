"""Statistics of the pages computed a second time, without the code that the pages use."""

import numpy as np
from scipy.stats import norm, t

Z = norm.ppf(0.975)


def bounded(values: np.ndarray) -> tuple[float, float, float]:
    """Mean and 95 % interval of values from 0 to 1: Student's t with z²/4 zeros and ones added."""
    weights = np.append(np.ones(len(values)), [Z**2 / 4] * 2)
    sample, n = np.append(values, [0.0, 1.0]), weights.sum()
    centre = np.average(sample, weights=weights)
    variance = weights @ (sample - centre) ** 2 / (n - 1)
    half = t.ppf(0.975, n - 1) * np.sqrt(variance / n)
    mean = float(np.mean(values))
    return mean, min(max(centre - half, 0.0), mean), max(min(centre + half, 1.0), mean)
