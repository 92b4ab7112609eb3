"""SIMD numbers as a type of numba's: the processor's vector of four floats, and its operations."""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing import signature
from numba.core.typing.templates import ConcreteTemplate, infer_global
from numba.extending import intrinsic, lower_builtin, models, register_model

from .simd_arrays import WIDTH

# products may be joined with sums, which saves a rounding
_FAST = ("contract", "reassoc", "nsz")


class LanesType(types.Type):
    """Four floats, one of each element."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes({WIDTH})")


LANES = LanesType()
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, _VECTOR)


def _spread(builder: Any, value: Any) -> Any:
    """All four the same."""
    index = ir.IntType(32)
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, index(0))
    return builder.shuffle_vector(
        one, ir.Constant(_VECTOR, ir.Undefined), ir.Constant(ir.VectorType(index, WIDTH), [0] * WIDTH)
    )


def _register(operation: Any, name: str) -> None:
    @infer_global(operation)
    class _Template(ConcreteTemplate):
        cases = (
            signature(LANES, LANES, LANES),
            signature(LANES, LANES, types.float64),
            signature(LANES, types.float64, LANES),
        )

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        both = [
            value if kind == LANES else _spread(builder, value)
            for kind, value in zip(sig.args, args, strict=True)
        ]
        return getattr(builder, name)(*both, flags=_FAST)

    for case in _Template.cases:
        lower_builtin(operation, *case.args)(lower)


for _name, _operations in {
    "fadd": (operator.add, operator.iadd),
    "fsub": (operator.sub, operator.isub),
    "fmul": (operator.mul, operator.imul),
    "fdiv": (operator.truediv, operator.itruediv),
}.items():
    for _operation in _operations:
        _register(_operation, _name)


@infer_global(operator.neg)
class _Negation(ConcreteTemplate):
    cases = (signature(LANES, LANES),)


@lower_builtin(operator.neg, LANES)
def _negate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0], flags=_FAST)


def _indices(context: Any, builder: Any, kinds: Any, indices: Any) -> list[Any]:
    places = cgutils.unpack_tuple(builder, indices, len(kinds[1]))
    return [context.cast(builder, p, k, types.intp) for p, k in zip(places, kinds[1], strict=True)]


def _place(context: Any, builder: Any, kinds: Any, array: Any, indices: Any) -> Any:
    """Where the four of an array's entry lie, as a pointer to a vector."""
    places = _indices(context, builder, kinds, indices)
    if kinds[0].layout == "C":
        # the last axis has a length that the compiler may know: what differs by a known number of places is
        # then a known number of bytes away
        struct = context.make_array(kinds[0])(context, builder, array)
        shape, place = cgutils.unpack_tuple(builder, struct.shape), places[0]
        for axis in range(1, len(places)):
            place = builder.add(builder.mul(place, shape[axis], flags=["nsw"]), places[axis], flags=["nsw"])
        return builder.gep(builder.bitcast(struct.data, _VECTOR.as_pointer()), [place], inbounds=True)
    return _at(context, builder, kinds, array, [*places, context.get_constant(types.intp, 0)])


def _from(context: Any, builder: Any, kinds: Any, array: Any, indices: Any) -> Any:
    """A pointer to the vector that begins with an array's number at these indices."""
    return _at(context, builder, kinds, array, _indices(context, builder, kinds, indices))


def _at(context: Any, builder: Any, kinds: Any, array: Any, places: list[Any]) -> Any:
    struct = context.make_array(kinds[0])(context, builder, array)
    pointer = cgutils.get_item_pointer(context, builder, kinds[0], struct, places, wraparound=False)
    return builder.bitcast(pointer, _VECTOR.as_pointer())


def _loading(place: Any) -> Any:
    """What loads the four at a place; see `simd_arrays`."""

    @intrinsic
    def load(typing: Any, array: Any, indices: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.load(place(context, builder, sig.args, *args), align=8)

        return LANES(array, indices), generate

    return load


def _storing(place: Any) -> Any:
    """What stores the four at a place; see `simd_arrays`."""

    @intrinsic
    def store(typing: Any, array: Any, indices: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            builder.store(args[2], place(context, builder, sig.args, *args[:2]), align=8)
            return context.get_dummy_value()

        return types.void(array, indices, value), generate

    return store


load, store = _loading(_place), _storing(_place)
load_from, store_from = _loading(_from), _storing(_from)


@intrinsic
def spread(typing: Any, value: Any) -> Any:
    """See `simd_arrays.spread`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _spread(builder, args[0])

    return LANES(types.float64), generate


@intrinsic
def transposed(typing: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """See `simd_arrays.transposed`."""
    four = types.UniTuple(LANES, WIDTH)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        def mixed(first: Any, second: Any, *places: int) -> Any:
            mask = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), list(places))
            return builder.shuffle_vector(first, second, mask)

        even = [mixed(args[i], args[i + 1], 0, 4, 2, 6) for i in (0, 2)]
        odd = [mixed(args[i], args[i + 1], 1, 5, 3, 7) for i in (0, 2)]
        columns = [
            mixed(*even, 0, 1, 4, 5),
            mixed(*odd, 0, 1, 4, 5),
            mixed(*even, 2, 3, 6, 7),
            mixed(*odd, 2, 3, 6, 7),
        ]
        return context.make_tuple(builder, four, columns)

    return four(LANES, LANES, LANES, LANES), generate


@intrinsic
def all_below(typing: Any, value: Any, bound: Any) -> Any:
    """See `simd_arrays.all_below`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        below = builder.fcmp_ordered("<", args[0], _spread(builder, args[1]))
        bits = builder.bitcast(below, ir.IntType(WIDTH))
        return builder.icmp_unsigned("==", bits, ir.Constant(bits.type, 2**WIDTH - 1))

    return types.boolean(LANES, types.float64), generate


@intrinsic
def lane(typing: Any, value: Any, place: Any) -> Any:
    """See `simd_arrays.lane`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.extract_element(*args)

    return types.float64(LANES, types.intp), generate


@intrinsic
def larger(typing: Any, a: Any, b: Any) -> Any:
    """See `simd_arrays.larger`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", args[1], args[0]), args[1], args[0])

    return LANES(LANES, LANES), generate


def _of_each(name: str) -> Any:
    """A function of the compiler's that acts on each of the four."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
        return builder.call(function, args)

    return generate


@intrinsic
def root(typing: Any, value: Any) -> Any:
    """See `simd_arrays.root`."""
    return LANES(LANES), _of_each("sqrt")


@intrinsic
def nearest(typing: Any, value: Any) -> Any:
    """See `simd_arrays.nearest`."""
    return LANES(LANES), _of_each("rint")
