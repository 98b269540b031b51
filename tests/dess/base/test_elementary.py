"""Elementary functions of our own: their errors, their bits, and that there is no other door."""

import ast
import math
from collections.abc import Callable, Iterator
from decimal import Decimal, getcontext, localcontext
from pathlib import Path

import numpy as np
import pytest

from dess.base import elementary
from dess.base.kernels import kernel

ROOT = Path(__file__).parents[3]
COMPILED = (elementary.exp, elementary.log, elementary.log1p)
PI = Decimal("3.1415926535897932384626433832795028841971693993751058209749445923078164062862089986")


def _sine(x: Decimal) -> Decimal:
    x = x.remainder_near(2 * PI)
    term = total = x
    for n in range(1, 60):
        term *= -x * x / (2 * n * (2 * n + 1))
        total += term
    return total


EXACT: dict[str, Callable[..., Decimal]] = {
    "exp": Decimal.exp,
    "log": Decimal.ln,
    "log1p": lambda x: (1 + x).ln(),
    "log10": Decimal.log10,
    "sin": _sine,
    "cos": lambda x: _sine(x + PI / 2),
    "hypot": lambda x, y: (x * x + y * y).sqrt(),
}


def _arguments(name: str) -> Iterator[tuple[float, ...]]:
    """Drawn arguments of a function, over all that it takes and where its steps differ."""
    draw = np.random.default_rng(1)
    count = 400
    wide = 10.0 ** draw.uniform(-300, 300, count)
    small = 10.0 ** draw.uniform(-300, 0, count)
    subnormal = draw.integers(1, 2**52, count).view(np.float64)
    numbers = {
        "exp": [*draw.uniform(-745, 709.7, (2, count)), draw.uniform(-4, 4, count), small],
        "log": [wide, subnormal, draw.uniform(0.5, 2, count), draw.normal(1, 1e-3, count)],
        "log1p": [wide, draw.uniform(-1, 3, count), draw.normal(0, 1e-9, count), subnormal],
        "sin": [draw.uniform(-7, 7, count), draw.uniform(-(2**20), 2**20, count), small],
        "hypot": [wide, draw.uniform(0, 1, count), subnormal, draw.uniform(1, 9, count)],
    }
    numbers["log10"] = numbers["log"]
    numbers["sin"].append(np.arange(count) * math.pi / 2)
    numbers["cos"] = numbers["sin"]
    for x in np.concatenate(numbers[name]).tolist():
        yield (x, x * draw.uniform(0, 2)) if name == "hypot" else (x,)


@pytest.mark.parametrize("name", EXACT)
def test_errors_are_below_one_unit_in_the_last_place(name):
    function = getattr(elementary, name)
    with localcontext() as context:
        context.prec = 75
        context.Emin = -(10**6)
        for arguments in _arguments(name):
            if name == "log1p" and abs(arguments[0]) < 1e-50:
                exact = Decimal(arguments[0])  # up to a part in 1e50
            else:
                exact = EXACT[name](*map(Decimal, arguments))
            error = abs(Decimal(function(*arguments)) - exact)
            assert error < Decimal(math.ulp(float(exact))), arguments
    assert getcontext().prec == 28


@pytest.mark.parametrize("name", ["sin", "cos", "sqrt"])
@pytest.mark.filterwarnings("ignore:invalid value")
def test_arrays_have_the_bits_of_their_numbers(name):
    numbers = np.array([x for [x] in _arguments("sin")] + [0.0, 2e6, math.nan])
    numbers = np.abs(numbers) if name == "sqrt" else numbers
    function = getattr(elementary, name)
    each = np.array([function(x) for x in numbers.tolist()])
    assert function(numbers).tobytes() == each.tobytes()


def test_angles_of_points_are_within_two_units_in_the_last_place():
    """Sine and cosine of the exact angle are those of the point: y cos - x sin is its error."""
    draw = np.random.default_rng(2)
    x, y = draw.normal(size=(2, 300)) * 10.0 ** draw.uniform(-5, 5, (2, 300))
    angles = elementary.atan2(y, x)
    with localcontext() as context:
        context.prec = 60
        for angle, *point in zip(angles.tolist(), x.tolist(), y.tolist(), strict=True):
            px, py = map(Decimal, point)
            exact = Decimal(angle)
            across = py * _sine(exact + PI / 2) - px * _sine(exact)
            error = abs(across) / (px * px + py * py).sqrt()
            assert error < 2 * Decimal(math.ulp(angle)), point


def test_angles_at_the_axes():
    points = {(0, 1): 0.0, (1, 0): 0.5, (0, -1): 1.0, (-1, 0): -0.5, (1, 1): 0.25, (-1, -1): -0.75}
    for (y, x), half_turns in points.items():
        assert elementary.atan2(y, x) == half_turns * math.pi
    assert elementary.atan2(0.0, 0.0) == 0.0
    assert math.isnan(elementary.atan2(math.nan, 1.0))


def test_powers_of_ten_have_whole_logarithms():
    numbers = np.array([float(f"1e{k}") for k in range(-307, 309)])
    assert elementary.log10(numbers).tolist() == [*range(-307, 309)]


INF, NAN, LEAST = math.inf, math.nan, 5e-324
LARGEST = np.finfo(float).max.item()


NEVER = [(INF, NAN), (-INF, NAN), (NAN, NAN), (2e6, NAN)]
EDGES = {
    "exp": [
        *((0.0, 1.0), (-0.0, 1.0), (LEAST, 1.0), (INF, INF), (-INF, 0.0), (NAN, NAN)),
        *((709.782712893385, INF), (LARGEST, INF), (-745.13, LEAST), (-745.14, 0.0)),
        (-LARGEST, 0.0),
    ],
    "log": [
        *((1.0, 0.0), (0.0, -INF), (-0.0, -INF), (INF, INF), (-INF, NAN), (NAN, NAN)),
        *((-1.0, NAN), (-LEAST, NAN)),
    ],
    "log1p": [
        *((0.0, 0.0), (-0.0, -0.0), (LEAST, LEAST), (-LEAST, -LEAST), (INF, INF), (-INF, NAN)),
        *((NAN, NAN), (-1.0, -INF), (-1.5, NAN)),
    ],
    "sin": [(0.0, 0.0), (-0.0, -0.0), (LEAST, LEAST), *NEVER],
    "cos": [(0.0, 1.0), (-0.0, 1.0), (LEAST, 1.0), *NEVER],
}
EDGES["log10"] = EDGES["log"]


@pytest.mark.parametrize("name", EDGES)
@pytest.mark.filterwarnings("error")
def test_at_the_edges_they_are_what_ieee_754_says(name):
    for x, value in EDGES[name]:
        assert _bits(getattr(elementary, name)(x)) == _bits(value), x


@pytest.mark.filterwarnings("error")
def test_a_hypotenuse_neither_overflows_nor_vanishes_on_the_way():
    for x, y, length in [
        *((0.0, 0.0, 0.0), (-0.0, 0.0, 0.0), (0.0, -2.0, 2.0), (3 * LEAST, -4 * LEAST, 5 * LEAST)),
        *((3e300, 4e300, 5e300), (LARGEST, 0.0, LARGEST), (LARGEST, LEAST, LARGEST)),
        *((-INF, 1.0, INF), (NAN, INF, INF), (NAN, 1.0, NAN), (0.0, NAN, NAN)),
    ]:
        assert _bits(elementary.hypot(x, y)) == _bits(length), (x, y)
        assert _bits(elementary.hypot(y, x)) == _bits(length), (y, x)


def _bits(x: float) -> str:
    return float(x).hex()


PINS = {
    "exp": {
        1.0: "0x1.5bf0a8b14576ap+1",
        -0.3: "0x1.7b4c869c37c05p-1",
        80.07202714550806: "0x1.6ef8334025b50p+115",
        -700.5: "0x1.4ff475c68ca02p-1011",
        -740.0: "0x0.0000000000055p-1022",
    },
    "log": {
        2.0: "0x1.62e42fefa39efp-1",
        0.3: "-0x1.34378fcbda721p+0",
        1.410905898584961: "0x1.607e59163d1aep-2",
        1e-310: "-0x1.64e69394d9508p+9",
        60000000.0: "0x1.1e8ec43e14c73p+4",
    },
    "log1p": {
        1e-09: "0x1.12e0be801f1d9p-30",
        0.3763916342010686: "0x1.4721ea810fbbfp-2",
        0.7: "0x1.0fae81914a991p-1",
        -0.9: "-0x1.26bb1bbb55516p+1",
        1000000000000.0: "0x1.ba18a999000bap+4",
    },
    "log10": {
        2.0: "0x1.34413509f79ffp-2",
        0.8039103986613431: "-0x1.8444fcae02220p-4",
        1.2664332810491783: "0x1.a42d5a7ffe7ccp-4",
        1e-310: "-0x1.3600000000000p+8",
        5000000.0: "0x1.acbbecaf60860p+2",
    },
    "sin": {
        1.0: "0x1.aed548f090ceep-1",
        math.pi: "0x1.1a62633145c07p-53",
        -0.8154223214238003: "-0x1.74be683553a58p-1",
        6.0: "-0x1.1e1f18ab0a2c0p-2",
        100000.0: "0x1.24daa9c527e96p-5",
    },
    "cos": {
        1.0: "0x1.14a280fb5068cp-1",
        math.pi / 2: "0x1.1a62633145c07p-54",
        6.998659308009858: "0x1.8272d67cc238bp-1",
        -4.0: "-0x1.4eaa606db24c1p-1",
        100000.0: "-0x1.ffac3841b3da7p-1",
    },
}


@pytest.mark.parametrize("name", PINS)
def test_every_machine_gives_these_bits(name):
    found = {x: _bits(getattr(elementary, name)(x)) for x in PINS[name]}
    assert found == PINS[name]


def test_every_machine_gives_these_hypotenuses():
    pairs = {
        (1.0, 1.0): "0x1.6a09e667f3bcdp+0",
        (0.44740416289789176, 0.7381662397054346): "0x1.b9f1392f73e61p-1",
        (30.0, 1000.0): "0x1.f4399648a2abap+9",
    }
    assert {pair: _bits(elementary.hypot(*pair)) for pair in pairs} == pairs


@pytest.mark.parametrize("function", COMPILED, ids=lambda function: function.__name__)
def test_compiled_and_interpreted_calls_give_the_same_bits(function):
    for (x,) in _arguments(function.__name__):
        assert _bits(function(x)) == _bits(function.py_func(x)), x


def test_arrays_and_numbers_have_the_same_bits():
    numbers = np.array([x for (x,) in _arguments("log10")])
    others = numbers[::-1]
    assert elementary.log10(numbers).tolist() == [*map(elementary.log10, numbers.tolist())]
    lengths = map(elementary.hypot, numbers.tolist(), others.tolist())
    assert elementary.hypot(numbers, others).tolist() == [*lengths]


@kernel
def _multiply_and_add(a, b, c, out):
    for number in range(len(out)):
        out[number] = a[number] * b[number] + c[number]


def test_compiled_code_rounds_a_product_before_it_is_added():
    """Neither one by one nor, with eight of them, as vectors."""
    for count in (1, 8, 64):
        out = np.empty(count)
        _multiply_and_add(
            np.full(count, 1 + 2.0**-30), np.full(count, 1 - 2.0**-30), np.full(count, -1.0), out
        )
        assert (out == 0.0).all()  # fused, it would be -2**-60


# The rooms on the way to the records of heuristics, of the planner and of a network in integers.
ROOMS = ("dess/base", "dess/physics", "dess/scenario", "dess/model", "dess/envs/observations")
ROOMS += ("policies/planner", "policies/choices.py", "policies/integers.py", "policies/dense.py")
# What is exact, or rounded in one way only: all else of ``math`` is the C library's.
OF_MATH = {
    *("ceil", "floor", "fsum", "inf", "isfinite", "isnan", "lcm", "nan", "pi", "radians", "sqrt"),
}
# Functions of numpy whose last bits depend on the processor, on numpy's version, LAPACK or BLAS.
OF_NUMPY = {
    *("arccos", "arcsin", "arctan", "arctan2", "average", "cbrt", "convolve", "cos", "cosh", "dot"),
    *("einsum", "exp", "exp2", "expm1", "fft", "float_power", "geomspace", "hypot", "inner"),
    *("interp", "linalg", "log", "log10", "log1p", "log2", "logaddexp", "logspace", "matmul"),
    *("mean", "nanmean", "nansum", "outer", "polynomial", "power", "random", "sin", "sinc", "sinh"),
    *("std", "sum", "tan", "tanh", "tensordot", "trapezoid", "var", "vdot"),
}
SUMS = {"dot", "mean", "std", "sum", "var"}  # methods of arrays; ``sum`` of Python as well
# What else there is, and why it is the same everywhere.
EXCEPTIONS = {
    "cells and counts are whole numbers": {
        ("dess/envs/observations/components.py", "mission.pads_out[:mission.pads].sum()"),
        ("dess/envs/observations/states.py", "np.abs(cells - nearest).sum(1)"),
        ("dess/model/view.py", "constants['pads_out'].sum(1)"),
        ("dess/scenario/consistency.py", "MOST_CHARTED ** 2"),
        (
            "dess/scenario/consistency.py",
            "sum((width * height for *_, width, height in c.rectangles))",
        ),
        ("dess/scenario/families.py", "(~land).sum()"),
        ("dess/scenario/families.py", "near.sum()"),
        ("dess/scenario/families.py", "windows.sum((2, 3))"),
        ("dess/scenario/fields.py", "sum(self.zone_pads)"),
        ("policies/choices.py", "cells @ [1, shape[1]]"),
        ("policies/planner/courses.py", "crafts['active'].sum()"),
    },
    "widths of layers are whole numbers": {
        ("policies/integers.py", "sum(_POOLED)"),
        ("policies/integers.py", "sum(_POOLED[:number])"),
        ("policies/integers.py", "sum((inputs * outputs for inputs, outputs in LAYERS.values()))"),
        ("policies/integers.py", "sum((LAYERS[name][1] for name in SHIFTED))"),
        ("policies/integers.py", "sum(SCALES.values())"),
    },
    "they are lists": {
        ("dess/envs/observations/components.py", "sum(_beyond_the_paper(space), [])"),
        ("dess/envs/observations/components.py", "sum(map(len, groups))"),
        (
            "dess/envs/observations/sets.py",
            "sum((((size, part), (MOVES, size)) for part, size in sizes.items()), ())",
        ),
    },
    "of cells, open or not": {("dess/scenario/no_fly.py", "from scipy import ndimage")},
    "compiled, it is a loop": {
        ("policies/planner/policy.py", "residual[b].sum()"),
    },
    "a sea is refused by it, and no record has it": {
        ("dess/scenario/projection.py", "np.arcsin"),
        ("dess/scenario/projection.py", "np.cos"),
        ("dess/scenario/projection.py", "np.sin"),
        (
            "dess/scenario/projection.py",
            "np.sin((degrees[first] - degrees[second]) / 2) ** 2",
        ),
    },
    "a sum of two": {
        ("dess/scenario/nodes.py", "(across * across).sum(1)"),
    },
}


def test_no_other_function_decides_the_bits_of_records():
    sources = [
        path
        for room in ROOMS
        for path in ([ROOT / room] if room.endswith(".py") else (ROOT / room).rglob("*.py"))
    ]
    found = {
        (path.relative_to(ROOT).as_posix(), ast.unparse(node))
        for path in sources
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if _may_differ(node)
    }
    allowed = set.union(*EXCEPTIONS.values())
    assert found - allowed == set()
    assert allowed - found == set()


def _may_differ(node: ast.AST) -> bool:
    """Whether the last bits of what a node computes may depend on the machine or a library."""
    match node:
        case ast.ImportFrom(module="math", names=names):
            return not {alias.name for alias in names} <= OF_MATH
        case ast.ImportFrom(module="numpy", names=names):
            return bool({alias.name for alias in names} & OF_NUMPY)
        case ast.ImportFrom(module="cmath" | "scipy"):
            return True
        case ast.Attribute(value=ast.Name(id="math"), attr=name):
            return name not in OF_MATH
        case ast.Attribute(value=ast.Name(id="np"), attr=name):
            return name in OF_NUMPY
        case ast.Call(func=ast.Attribute(attr=name)):
            return name in SUMS
        case ast.Call(func=ast.Name(id="sum")):
            return True
        case ast.BinOp(op=ast.MatMult()) | ast.AugAssign(op=ast.Pow() | ast.MatMult()):
            return True
        case ast.BinOp(left=ast.Constant(value=2 | 10), op=ast.Pow(), right=exponent):
            return not ast.unparse(exponent).removeprefix("-").isdigit()  # or it is exact
        case ast.BinOp(op=ast.Pow()):
            return True
    return False
