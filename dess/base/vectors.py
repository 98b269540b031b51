"""Vectors of small integers, for networks in integers: products of layers, and maxima.

``layer`` and ``pool`` make functions that compiled code can call. They are exact in integers, so
which instructions compute them changes no result: x86 and WebAssembly add the products of two pairs
of 16-bit numbers in one instruction, and other processors do what the compiler makes of the plain
form.

A *pair* is two 16-bit numbers that lie side by side. The weights of a layer with I inputs (an even
number) and O outputs are (I / 2, O, 2), so that one vector has the weights of a pair of inputs for
several outputs.
"""

from typing import Any, NamedTuple

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

MOST = 2**14 - 1  # the largest activation

_I16, _I32, _I64 = ir.IntType(16), ir.IntType(32), ir.IntType(64)


class Instructions(NamedTuple):
    """What a processor computes with.

    Attributes:
        size: How many 32-bit sums a vector holds.
        products: The instruction that adds the products of two pairs; empty for the plain form.
        sums: How many vectors of sums are kept at a time.
    """

    size: int
    products: str
    sums: int


FORMS = {
    "avx2": Instructions(8, "llvm.x86.avx2.pmadd.wd", 16),
    "sse2": Instructions(4, "llvm.x86.sse2.pmadd.wd", 8),
    "wasm": Instructions(4, "llvm.wasm.dot", 8),
    "plain": Instructions(4, "", 8),
}


def form_of(triple: str, features: str) -> str:
    """The form for a target of LLVM."""
    if triple.startswith("wasm32"):
        return "wasm"
    if triple.startswith("x86_64"):
        return "avx2" if "+avx2" in features.split(",") else "sse2"
    return "plain"


def instructions_of(context: Any) -> Instructions:
    """The instructions of the processor for which numba compiles."""
    triple, _, features = context.codegen().magic_tuple()
    return FORMS[form_of(triple, features)]


def layer(rows: int, outputs: int) -> Any:
    """Make the function of a layer for some rows of inputs.

    It is called with ``out, values, weights, bias, pairs, count, shift, least``:

    ``out[r, c] = clip((bias[c] + sum of values[r, i] * weights[i, c]) >> shift, least, MOST)``

    for the inputs of the first ``count`` entries of ``pairs``. If ``out`` has 32 bits, the sums are
    written as they are.

    Args:
        rows: How many rows of ``values`` there are, one after the other: at most as many as the
            array has. ``out`` has them without a gap.
        outputs: The outputs, a multiple of 8.
    """

    @intrinsic
    def apply(typing, out, values, weights, bias, pairs, count, shift, least):
        def generate(context, builder, signature, args):
            use = instructions_of(context)
            out_at, values_at, weights_at, bias_at, pairs_at = (
                _data(context, builder, kind, value)
                for kind, value in zip(signature.args[:5], args[:5], strict=True)
            )
            stride = _row_length(context, builder, signature.args[1], args[1])
            length, shift_by, low = args[5:]
            chunks = range(outputs // use.size)
            each = max(use.sums // rows, 1)
            for first in chunks[::each]:
                group = [(r, c) for c in chunks[first : first + each] for r in range(rows)]
                sums = _start_sums(builder, use, group, bias_at)
                with cgutils.for_range(builder, length, intp=_I64) as loop:
                    pair = builder.zext(_load(builder, pairs_at, loop.index, _I32), _I64)
                    inputs = [
                        _splat_pair(builder, use, values_at, _plus(builder, stride, r, pair))
                        for r in range(rows)
                    ]
                    _add_products(builder, use, group, sums, inputs, weights_at, pair, outputs)
                for place, total in sums.items():
                    number = place[0] * outputs + place[1] * use.size
                    value = builder.load(total)
                    if signature.args[0].dtype == types.int32:
                        _store(builder, value, out_at, number, _I32)
                    else:
                        value = builder.ashr(value, _splat(builder, shift_by, use.size))
                        _store(builder, _clip(builder, value, low), out_at, number, _I16)
            return context.get_dummy_value()

        array = types.Array
        if not all(isinstance(kind, array) for kind in (out, values, weights, bias, pairs)):
            return None
        scalars = types.int64, types.int32, types.int32
        return types.void(out, values, weights, bias, pairs, *scalars), generate

    return apply


def pool(width: int) -> Any:
    """Make the function that takes the best of some rows.

    It is called with ``best, values, factors, rows, count``:

    ``best[c] = max(0, factors[n] * values[n, c] / 32768, rounded)``

    over the rows n in the first ``count`` entries of ``rows``. A factor of 32767 leaves a value as
    it is.

    Args:
        width: The columns, a multiple of 16.
    """

    @intrinsic
    def take(typing, best, values, factors, rows, count):
        def generate(context, builder, signature, args):
            size = 2 * instructions_of(context).size
            best_at, values_at, factors_at, rows_at = (
                _data(context, builder, kind, value)
                for kind, value in zip(signature.args[:4], args[:4], strict=True)
            )
            narrow, wide = ir.VectorType(_I16, size), ir.VectorType(_I32, size)
            chunks = range(0, width, size)
            highest = [
                cgutils.alloca_once_value(builder, ir.Constant(narrow, None)) for _ in chunks
            ]
            fourteen, one = (ir.Constant(wide, [number] * size) for number in (14, 1))
            with cgutils.for_range(builder, args[4], intp=_I64) as loop:
                row = builder.zext(_load(builder, rows_at, loop.index, _I32), _I64)
                factor = builder.sext(_load(builder, factors_at, row, _I16), _I32)
                factor = _splat(builder, factor, size)
                for first, box in zip(chunks, highest, strict=True):
                    place = builder.add(builder.mul(row, _I64(width)), _I64(first))
                    value = builder.sext(_load(builder, values_at, place, _I16, size), wide)
                    # In this order, it is one instruction of x86 and of WebAssembly.
                    product = builder.lshr(builder.mul(value, factor), fourteen)
                    value = builder.lshr(builder.add(product, one), one)
                    value = builder.trunc(value, narrow)
                    before = builder.load(box)
                    is_higher = builder.icmp_signed(">", value, before)
                    builder.store(builder.select(is_higher, value, before), box)
            for first, box in zip(chunks, highest, strict=True):
                _store(builder, builder.load(box), best_at, first, _I16)
            return context.get_dummy_value()

        return types.void(best, values, factors, rows, types.int64), generate

    return take


def _start_sums(builder: Any, use: Instructions, group: Any, bias_at: Any) -> dict[Any, Any]:
    """Memory for the sums of rows and chunks, which the compiler keeps in registers."""
    return {
        (r, c): cgutils.alloca_once_value(
            builder, _load(builder, bias_at, _I64(c * use.size), _I32, use.size)
        )
        for r, c in group
    }


def _add_products(
    builder: Any,
    use: Instructions,
    group: Any,
    sums: dict[Any, Any],
    inputs: list[Any],
    weights_at: Any,
    pair: Any,
    outputs: int,
) -> None:
    """Add the products of a pair of inputs of each row to the sums."""
    first = builder.mul(pair, _I64(2 * outputs))
    for chunk in dict.fromkeys(c for _, c in group):
        place = builder.add(first, _I64(2 * chunk * use.size))
        weights = _load(builder, weights_at, place, _I16, 2 * use.size)
        for r, values in enumerate(inputs):
            total = sums[r, chunk]
            products = _sum_of_products(builder, use, values, weights)
            builder.store(builder.add(builder.load(total), products), total)


def _sum_of_products(builder: Any, use: Instructions, a: Any, b: Any) -> Any:
    """The sums of the products of pairs, for vectors of pairs."""
    wide = ir.VectorType(_I32, use.size)
    if use.products:
        kind = ir.FunctionType(wide, [a.type, b.type])
        function = cgutils.get_or_insert_function(builder.module, kind, use.products)
        return builder.call(function, [a, b])
    products = []
    for first in (0, 1):
        half = ir.Constant(wide, [*range(first, 2 * use.size, 2)])
        x, y = (builder.sext(builder.shuffle_vector(v, v, half), wide) for v in (a, b))
        products.append(builder.mul(x, y))
    return builder.add(*products)


def _splat_pair(builder: Any, use: Instructions, values_at: Any, place: Any) -> Any:
    """A vector of the pair at a place, again and again."""
    pair = _load(builder, builder.bitcast(values_at, ir.PointerType(_I32)), place, _I32)
    return builder.bitcast(_splat(builder, pair, use.size), ir.VectorType(_I16, 2 * use.size))


def _plus(builder: Any, stride: Any, row: int, pair: Any) -> Any:
    """The place of a pair in a row; both are counted in pairs."""
    pairs_of_row = builder.lshr(stride, _I64(1))
    return builder.add(builder.mul(pairs_of_row, _I64(row)), pair)


def _clip(builder: Any, value: Any, low: Any) -> Any:
    """32-bit numbers as 16-bit ones, from ``low`` to ``MOST``."""
    size = value.type.count
    least = _splat(builder, low, size)
    most = ir.Constant(value.type, [MOST] * size)
    value = builder.select(builder.icmp_signed("<", value, least), least, value)
    value = builder.select(builder.icmp_signed(">", value, most), most, value)
    return builder.trunc(value, ir.VectorType(_I16, size))


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """The pointer to the entries of an array."""
    return context.make_array(kind)(context, builder, array).data


def _row_length(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """The length of the rows of an array."""
    shape = context.make_array(kind)(context, builder, array).shape
    return builder.extract_value(shape, kind.ndim - 1)


def _splat(builder: Any, value: Any, size: int) -> Any:
    """A vector with the same number everywhere."""
    kind = ir.VectorType(value.type, size)
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), value, _I32(0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(_I32, size), [0] * size))


def _load(builder: Any, pointer: Any, place: Any, item: Any, size: int = 0) -> Any:
    """The number at a place, or that many from there on."""
    kind = ir.VectorType(item, size) if size else item
    at = builder.gep(pointer, [place], source_etype=item)
    return builder.load(builder.bitcast(at, ir.PointerType(kind)), align=2, typ=kind)


def _store(builder: Any, value: Any, pointer: Any, place: int, item: Any) -> None:
    """Write numbers from a place on."""
    at = builder.gep(pointer, [_I64(place)], source_etype=item)
    builder.store(value, builder.bitcast(at, ir.PointerType(value.type)), align=2)
