"""Elementary functions that give the same bits on every machine.

The C library and numpy choose among several versions of these functions by what the processor
offers, and the versions differ in their last bits. The functions here consist of additions,
multiplications, divisions, square roots and moves of bits, each of which IEEE 754 rounds in exactly
one way. Numba does not fuse a multiplication with an addition unless it is asked to
(``fastmath``). So the records of missions depend on code, scenario and seed alone. The errors are
below one unit in the last place, those of ``atan2`` below two.

``exp``, ``log`` and ``log1p`` are compiled, for missions. The others make tables and settings, and
are not, since compiling them would take longer than they do; all of these take arrays as well.

The argument is reduced to a small one, for which a polynomial does (P. T. P. Tang, ACM TOMS 15(2)
and 16(4); K. C. Ng). The polynomials, and the steps that keep the errors small, are those of
fdlibm, under this notice (``LICENSE-fdlibm``); those of ``hypot`` are C. F. Borges' (ACM TOMS 47).

    Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved.

    Developed at SunPro, a Sun Microsystems, Inc. business.
    Permission to use, copy, modify, and distribute this
    software is freely granted, provided that this notice
    is preserved.
"""

import math
from typing import Any

import numpy as np

from dess.base.kernels import inlined, kernel

# ln 2 in two parts, which are exact to 106 bits. The first ends in zeros, so that a whole number of
# at most 21 bits times it is exact; so it is with all first parts below.
_LN2_HIGH = 6.93147180369123816490e-01
_LN2_LOW = 1.90821492927058770002e-10
_PER_LN2 = 1.44269504088896338700
_ROUND = 1.5 * 2**52  # a number that is added to it is rounded to an integer

# x coth(x / 2) = 2 + x**2 / 6 - x**4 / 360 + ...: coefficients on [0, ln(2) / 2].
_E1 = 1.66666666666666019037e-01
_E2 = -2.77777777770155933842e-03
_E3 = 6.61375632143793436117e-05
_E4 = -1.65339022054652515390e-06
_E5 = 4.13813679705723846039e-08
_LARGEST = 7.09782712893383973096e02  # exp of what is above overflows
_SMALLEST = -7.45133219101941108420e02  # exp of what is below is 0
_TINY = 2.0**-1000

# (ln(1 + s) - ln(1 - s) - 2 s) / s in s**2: coefficients on [0, 0.1716].
_L1 = 6.666666666666735130e-01
_L2 = 3.999999999940941908e-01
_L3 = 2.857142874366239149e-01
_L4 = 2.222219843214978396e-01
_L5 = 1.818357216161805012e-01
_L6 = 1.531383769920937332e-01
_L7 = 1.479819860511658591e-01

_SQRT_HALF = 0x3FE6A09E00000000  # the bits of a number just below sqrt(1 / 2)
_LEAST_NORMAL = 2.0**-1022

# 1 / ln 10 and log10(2) in two parts.
_PER_LN10_HIGH = 4.34294492006301879883e-01
_PER_LN10_LOW = -1.01030500522316834433e-08
_LOG10_2_HIGH = 3.01029995663611771306e-01
_LOG10_2_LOW = 3.69423907715893078616e-13

# pi / 2 in three parts.
_QUARTER_HIGH = 1.57079632673412561417e00
_QUARTER_MIDDLE = 6.07710050630396597660e-11
_QUARTER_LOW = 2.02226624879595063154e-21
_PER_QUARTER = 6.36619772367581382433e-01
_FARTHEST = 2.0**20  # the largest angle whose quarters the first parts count exactly

# sin(x) / x - 1 and cos(x) - 1 + x**2 / 2, over x**2 and x**4: coefficients on [0, pi / 4].
_S1 = -1.66666666666666324348e-01
_S2 = 8.33333333332248946124e-03
_S3 = -1.98412698298579493134e-04
_S4 = 2.75573137070700676789e-06
_S5 = -2.50507602534068634195e-08
_S6 = 1.58969099521155010221e-10
_C1 = 4.16666666666666019037e-02
_C2 = -1.38888888888741095749e-03
_C3 = 2.48015872894767294178e-05
_C4 = -2.75573143513906633035e-07
_C5 = 2.08757232129817482790e-09
_C6 = -1.13596475577881948265e-11

# (x - atan(x)) / x in x**2: coefficients on [0, 7/16]; the bounds of intervals, and in two parts
# the arc tangents of 0, 1/2, 1, 3/2 and infinity, to which the polynomial is added.
_A0 = 3.33333333333329318027e-01
_A1 = -1.99999999998764832476e-01
_A2 = 1.42857142725034663711e-01
_A3 = -1.11111104054623557880e-01
_A4 = 9.09088713343650656196e-02
_A5 = -7.69187620504482999495e-02
_A6 = 6.66107313738753120669e-02
_A7 = -5.83357013379057348645e-02
_A8 = 4.97687799461593236017e-02
_A9 = -3.65315727442169155270e-02
_A10 = 1.62858201153657823623e-02
_ATAN_BOUNDS = np.array([7 / 16, 11 / 16, 19 / 16, 39 / 16])
_ATAN_HIGH = np.array(
    [0.0, 4.63647609000806093515e-01, 7.85398163397448278999e-01]
    + [9.82793723247329054082e-01, 1.57079632679489655800e00]
)
_ATAN_LOW = np.array(
    [0.0, 2.26987774529616870924e-17, 3.06161699786838301793e-17]
    + [1.39033110312309984516e-17, 6.12323399573676603587e-17]
)
_PI_LOW = 1.2246467991473531772e-16


@kernel
def exp(x):
    """``e ** x``: infinite where it overflows, 0 below the smallest float."""
    if x != x:
        return x
    if x > _LARGEST:
        return np.inf
    if x < _SMALLEST:
        return 0.0
    multiple = (x * _PER_LN2 + _ROUND) - _ROUND
    high = x - multiple * _LN2_HIGH
    low = multiple * _LN2_LOW
    r = high - low
    t = r * r
    c = r - t * (_E1 + t * (_E2 + t * (_E3 + t * (_E4 + t * _E5))))
    y = 1.0 - ((low - (r * c) / (2.0 - c)) - high)
    k = np.int64(multiple)
    if k > 1023:
        return y * 2.0 * _power_of_2(1023)
    if k < -1021:  # the result may be subnormal, and is rounded once
        return y * _power_of_2(k + 1000) * _TINY
    return y * _power_of_2(k)


# Of each number of an array, in plain Python, which needs not wait for a compiler.
exp_of_each = np.vectorize(exp.py_func, otypes=[float])


@inlined
def _power_of_2(k):
    """``2.0 ** k`` for k in -1022..1023."""
    return np.int64((k + 1023) << 52).view(np.float64)


@kernel
def log(x):
    """The natural logarithm; nan below 0."""
    k = 0
    if x < _LEAST_NORMAL:
        if x == 0.0:
            return -np.inf
        if x < 0.0:
            return np.nan
        k = -54
        x = x * 2.0**54
    if not x < np.inf:
        return x
    bits = np.float64(x).view(np.int64)
    exponent = _exponent(bits)
    f = np.int64(bits - (exponent << 52)).view(np.float64) - 1.0
    return _log_of_parts(np.float64(k + exponent), f, 0.0)


@kernel
def log1p(x):
    """``log(1 + x)``, which does not lose the digits of a small ``x``; nan below -1."""
    if not -1.0 < x < np.inf or x == 0.0:
        if x == -1.0:
            return -np.inf
        return np.nan if x < -1.0 else x
    # One way for all other numbers, since the compiler makes vectors of code without branches.
    y = 1.0 + x
    bits = np.float64(y).view(np.int64)
    k = _exponent(bits)
    lost = (1.0 - (y - x) if x > 1.0 else x - (y - 1.0)) / y  # by the sum, relative to it
    f = np.int64(bits - (k << 52)).view(np.float64) - 1.0
    return _log_of_parts(np.float64(k), f, lost)


@inlined
def _exponent(bits):
    """The k for which the float of these bits is 2**k times a number in [sqrt(1/2), sqrt(2))."""
    return (bits - _SQRT_HALF) >> 52


@inlined
def _log_of_parts(k, f, correction):
    """``k ln 2 + ln(1 + f) + correction`` for 1 + f in [sqrt(1/2), sqrt(2))."""
    half = 0.5 * f * f
    rest = _rest_of_log(f, half) + (k * _LN2_LOW + correction)
    return k * _LN2_HIGH - ((half - rest) - f)


@inlined
def _rest_of_log(f, half):
    """``ln(1 + f) - (f - half)``, where ``half`` is ``f**2 / 2``."""
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = w * (_L2 + w * (_L4 + w * _L6))
    odd = z * (_L1 + w * (_L3 + w * (_L5 + w * _L7)))
    return s * (half + (odd + even))


def log10(x: Any) -> Any:
    """The decimal logarithm of a number or of each in an array; nan below 0."""
    is_usual = (x > 0.0) & (x < np.inf)
    mantissa, exponent = np.frexp(np.where(is_usual, x, 1.0))
    is_low = mantissa < math.sqrt(0.5)
    f = np.where(is_low, 2.0 * mantissa, mantissa) - 1.0
    k = exponent - is_low
    half = 0.5 * f * f
    high = np.float64(np.float32(f - half))  # its product with 24 bits is exact
    low = ((f - high) - half) + _rest_of_log(f, half)
    whole = k * _LOG10_2_HIGH
    large = high * _PER_LN10_HIGH
    small = k * _LOG10_2_LOW + (low + high) * _PER_LN10_LOW + low * _PER_LN10_HIGH
    total = whole + large
    result = total + (((whole - total) + large) + small)
    unusual = np.where(x == 0.0, -np.inf, np.where(x < 0.0, np.nan, x))
    return _plain(np.where(is_usual, result, unusual))


def hypot(x: Any, y: Any) -> Any:
    """``sqrt(x**2 + y**2)`` of numbers or arrays, without overflow in between."""
    longer = np.maximum(np.abs(x), np.abs(y))
    shorter = np.minimum(np.abs(x), np.abs(y))
    is_usual = (longer > 0.0) & (longer < np.inf)
    exponent = np.frexp(np.where(is_usual, longer, 1.0))[1]
    a = np.ldexp(np.where(is_usual, longer, 1.0), -exponent)
    b = np.ldexp(np.where(is_usual, shorter, 0.0), -exponent)
    length = np.sqrt(a * a + b * b)
    # How far the square of the rounded length is off, in terms that are nearly exact.
    over_b = length - b
    over_a = length - a
    near = over_b * (over_b - 2.0 * (a - b)) + a * (2.0 * over_b - a)
    far = over_a * over_a + (b * (4.0 * over_a - b) + 2.0 * over_a * (a - 2.0 * b))
    length = length - np.where(length <= 2.0 * b, near, far) / (2.0 * length)
    is_infinite = np.isinf(x) | np.isinf(y)
    unusual = np.where(is_infinite, np.inf, longer)
    return _plain(np.where(is_usual, np.ldexp(length, exponent), unusual))


def _plain(values: np.ndarray) -> Any:
    """An array, or the number that an array without axes has."""
    return values if values.ndim else values.item()


def sqrt(x: Any) -> Any:
    """The square root of a number or of each in an array."""
    if isinstance(x, np.ndarray):
        return np.sqrt(x)
    return math.sqrt(x)


def sin(x: Any) -> Any:
    """The sine of an angle of at most 2**20 radians, or of each in an array; nan beyond."""
    if isinstance(x, np.ndarray):
        return _sin_of_each(x, 0)
    quadrant, high, low = _reduce_angle(x)
    value = (_cos_of_parts if quadrant % 2 else _sin_of_parts)(high, low)
    return -value if quadrant >= 2 else value


def cos(x: Any) -> Any:
    """The cosine of an angle of at most 2**20 radians, or of each in an array; nan beyond."""
    if isinstance(x, np.ndarray):
        return _sin_of_each(x, 1)
    quadrant, high, low = _reduce_angle(x)
    value = (_sin_of_parts if quadrant % 2 else _cos_of_parts)(high, low)
    return -value if quadrant in (1, 2) else value


def _sin_of_each(x: np.ndarray, quarters: int) -> np.ndarray:
    """The sines of angles to which so many quarters of a turn are added."""
    reduced, high, low = _reduce_angle(x)
    quadrants = (reduced + quarters) % 4
    values = np.where(quadrants % 2 == 1, _cos_of_parts(high, low), _sin_of_parts(high, low))
    return np.where(quadrants >= 2, -values, values)


def _reduce_angle(x: Any) -> tuple[Any, Any, Any]:
    """The quadrant of an angle, and the rest in [-pi/4, pi/4] in two parts; or those of each."""
    quarters: Any
    if isinstance(x, np.ndarray):
        x = np.where(np.abs(x) <= _FARTHEST, x, math.nan)
        quarters = np.rint(x * _PER_QUARTER)
    elif not abs(x) <= _FARTHEST:
        return 0, math.nan, math.nan
    else:
        quarters = round(x * _PER_QUARTER)
    first = x - quarters * _QUARTER_HIGH
    second = quarters * _QUARTER_MIDDLE
    rest = first - second
    third = quarters * _QUARTER_LOW - ((first - rest) - second)
    high = rest - third
    return quarters % 4, high, (rest - high) - third


def _sin_of_parts(x: Any, low: Any) -> Any:
    """The sine of ``x + low`` in [-pi/4, pi/4]."""
    z = x * x
    v = z * x
    r = _S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))
    return x - ((z * (0.5 * low - v * r) - low) - v * _S1)


def _cos_of_parts(x: Any, low: Any) -> Any:
    """The cosine of ``x + low`` in [-pi/4, pi/4]."""
    z = x * x
    r = z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6)))))
    half = 0.5 * z
    w = 1.0 - half
    return w + (((1.0 - w) - half) + (z * r - x * low))


def atan2(y: Any, x: Any) -> Any:
    """The angle [radians] from the x axis to the point (x, y), or of each in arrays; 0 for none."""
    y, x = np.asarray(y, float), np.asarray(x, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        angle = _atan(np.where(y == 0.0, 0.0, np.abs(y) / np.abs(x)))
    angle = np.where(x < 0.0, math.pi - (angle - _PI_LOW), angle)
    return _plain(np.where(y < 0.0, -angle, angle))


def _atan(x: np.ndarray) -> np.ndarray:
    """The arc tangents of numbers from 0 on, infinite ones included."""
    interval = np.searchsorted(_ATAN_BOUNDS, x, side="right")
    with np.errstate(divide="ignore", invalid="ignore"):
        reduced = np.choose(
            interval,
            [x, (2.0 * x - 1.0) / (2.0 + x), (x - 1.0) / (x + 1.0)]
            + [(x - 1.5) / (1.0 + 1.5 * x), -1.0 / x],
        )
    z = reduced * reduced
    w = z * z
    odd = z * (_A0 + w * (_A2 + w * (_A4 + w * (_A6 + w * (_A8 + w * _A10)))))
    even = w * (_A1 + w * (_A3 + w * (_A5 + w * (_A7 + w * _A9))))
    rest = (reduced * (odd + even) - _ATAN_LOW[interval]) - reduced
    return _ATAN_HIGH[interval] - rest
