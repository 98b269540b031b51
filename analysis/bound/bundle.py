"""The next prices to try: a proximal bundle method for convex functions.

The bounds and slopes found so far give a model of the bound, the largest of their tangents. The
next prices minimise the model plus the squared distance from the best prices so far (C. Lemarechal,
*Nondifferentiable optimization*, 1989). Whatever it returns, the bound at the prices is valid.
"""

import numpy as np

from dess.code.kernels import kernel

_STEPS = 300


@kernel
def next_prices(centre, most, lowest, points, bounds, slopes, width):
    """The prices that minimise the model plus the squared distance from ``centre``.

    Args:
        centre: (V,) the best prices so far.
        most: (V,) the largest prices allowed; the smallest are 0.
        lowest: The bound at ``centre``.
        points: (N, V) prices tried.
        bounds: (N,) the bounds there.
        slopes: (N, V) the derivatives there.
        width: Twice the weight of the model against the squared distance.

    Returns:
        (V,) prices, and the bound that the model has there.
    """
    count = len(bounds)
    offsets, model = np.empty(count), np.empty(count)
    for i in range(count):  # rounding, and the finite number of local prices, can lift a tangent
        offsets[i] = min(bounds[i] + (slopes[i] * (centre - points[i])).sum(), lowest)
    weights = np.zeros(count)
    weights[np.argmax(offsets)] = 1.0
    for _ in range(_STEPS):  # of the dual problem, between two tangents at a time
        slope = np.zeros(len(centre))
        for i in range(count):
            slope += weights[i] * slopes[i]
        prices = np.minimum(np.maximum(centre - width * slope, 0.0), most)
        above, under = 0, -1
        for i in range(count):
            model[i] = offsets[i] + (slopes[i] * (prices - centre)).sum()
            if model[i] > model[above]:
                above = i
            if weights[i] > 0.0 and (under < 0 or model[i] < model[under]):
                under = i
        gap = model[above] - model[under]
        if gap < 1e-7:
            break
        between = ((slopes[above] - slopes[under]) ** 2).sum()
        share = min(gap / (width * between), weights[under])
        weights[above] += share
        weights[under] -= share
    return prices, model.max()
