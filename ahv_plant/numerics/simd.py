# Copyright 2026 ahv developers, Apache-2.0
"""Lanes: a number type of compiled code that holds the same quantity of several runs.

`elementwise` functions accept lanes wherever they accept numbers, alone and within named tuples,
and then advance all runs at once: one vector instruction of the processor for each operation.
Every lane gets the bits of the scalar function. Comparisons give lanes of booleans, which
`select`, `&` and `|` understand; conditional expressions, `and` and `or` do not.

`load` and `store` move them from and to arrays with one row for each number and one column for
each run, or, for one run, numbers from and to arrays without columns. Lanes exist in compiled code
only; in plain Python there is one run at a time, whose numbers are floats.
"""

import math
import operator
from collections.abc import Callable, Iterator
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils, config
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.cpython.builtins import do_minmax
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_cast,
    models,
    overload,
    register_model,
)
from numpy.typing import NDArray

from ahv_plant.numerics.elementwise import Value, select

Array = NDArray[np.float64]
Emit = Callable[..., ir.Value]  # of numba's context, the builder, the signature and the arguments
Typed = tuple[types.Type, Emit] | None  # what an intrinsic returns: its signature and its code

# two vector registers of 8 doubles, to hide latencies
LANES = 1 if config.DISABLE_JIT else 16


class Lanes(types.Type):
    """Type of LANES numbers or booleans of one `dtype`."""

    def __init__(self, dtype: types.Type):
        self.dtype = dtype
        super().__init__(name=f"Lanes({dtype}, {LANES})")

    def can_convert_from(self, typingctx: Any, other: types.Type) -> Conversion | None:
        """A plain number goes to all lanes, but rather to a function of plain numbers."""
        if isinstance(other, Lanes) or typingctx.can_convert(other, self.dtype) is None:
            return None
        return Conversion.unsafe


FLOATS, INTEGERS, BOOLEANS = (
    Lanes(dtype) for dtype in (types.float64, types.int64, types.boolean)
)
_OF = {types.float64: FLOATS, types.int64: INTEGERS, types.boolean: BOOLEANS}


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Lanes):
        element = dmm.lookup(fe_type.dtype).get_value_type()
        super().__init__(dmm, fe_type, ir.VectorType(element, LANES))


@lower_cast(types.Number, Lanes)
@lower_cast(types.Boolean, Lanes)
def _to_all_lanes(
    context: Any, builder: ir.IRBuilder, from_type: types.Type, to_type: Lanes, value: ir.Value
) -> ir.Value:
    value = context.cast(builder, value, from_type, to_type.dtype)
    vector = context.get_value_type(to_type)
    index = ir.Constant(ir.IntType(32), 0)
    first = builder.insert_element(ir.Constant(vector, ir.Undefined), value, index)
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(vector, ir.Undefined), zeros)


def _operation(
    function: Callable[..., Any], count: int, argument: Lanes, result: Lanes, emit: Emit
) -> None:
    """Let compiled code use `function` of `count` arguments on lanes."""

    @infer_global(function)
    class _Template(AbstractTemplate):
        def generic(self, args: tuple[types.Type, ...], kws: Any) -> Any:
            fits = len(args) == count and any(a == argument for a in args)
            if fits and all(self.context.can_convert(a, argument) is not None for a in args):
                return signature(result, *[argument] * count)
            return None

    @lower_builtin(function, *[argument] * count)
    def _lower(context: Any, builder: ir.IRBuilder, sig: Any, args: list[ir.Value]) -> ir.Value:
        return emit(builder, *args)


def _llvm(name: str) -> Emit:
    def emit(builder: ir.IRBuilder, value: ir.Value) -> ir.Value:
        kind = ir.FunctionType(value.type, [value.type])
        full = f"llvm.{name}.v{LANES}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, full), [value])

    return emit


for _function, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _operation(_function, 2, FLOATS, FLOATS, lambda b, x, y, n=_name: getattr(b, n)(x, y))
for _function, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _operation(_function, 2, FLOATS, BOOLEANS, lambda b, x, y, s=_sign: b.fcmp_ordered(s, x, y))
_operation(operator.eq, 2, INTEGERS, BOOLEANS, lambda b, x, y: b.icmp_signed("==", x, y))
_operation(operator.and_, 2, BOOLEANS, BOOLEANS, lambda b, x, y: b.and_(x, y))
_operation(operator.or_, 2, BOOLEANS, BOOLEANS, lambda b, x, y: b.or_(x, y))
_operation(operator.neg, 1, FLOATS, FLOATS, lambda b, x: b.fneg(x))
_operation(abs, 1, FLOATS, FLOATS, _llvm("fabs"))
_operation(math.sqrt, 1, FLOATS, FLOATS, _llvm("sqrt"))


@infer_global(max)
class _MaxTemplate(AbstractTemplate):
    def generic(self, args: tuple[types.Type, ...], kws: Any) -> Any:
        return signature(FLOATS, *args) if args and all(a == FLOATS for a in args) else None


@lower_builtin(max, types.VarArg(Lanes))
def _lower_max(context: Any, builder: ir.IRBuilder, sig: Any, args: list[ir.Value]) -> ir.Value:
    return do_minmax(context, builder, sig.args, args, operator.gt)


@intrinsic
def lanes_select(
    typingctx: Any, condition: types.Type, chosen: types.Type, other: types.Type
) -> Typed:
    """`chosen` in the lanes where `condition` holds, else `other`."""
    if condition != BOOLEANS:
        return None
    dtypes = [a.dtype if isinstance(a, Lanes) else types.unliteral(a) for a in (chosen, other)]
    kind = _OF[typingctx.unify_types(*dtypes)]

    def emit(context: Any, builder: ir.IRBuilder, sig: Any, args: list[ir.Value]) -> ir.Value:
        return builder.select(*args)

    return kind(BOOLEANS, kind, kind), emit


def _leaves(kind: types.Type) -> Iterator[tuple[tuple[int, ...], types.Type]]:
    """Yield the index path and type of each number in a nested tuple type."""
    if isinstance(kind, types.BaseTuple):
        for i, part in enumerate(kind):
            for path, leaf in _leaves(part):
                yield (i, *path), leaf
    elif kind is not types.none:
        yield (), kind


def _widened(kind: types.Type) -> types.Type:
    """Return the nested tuple type with lanes of floats and integers for plain ones."""
    if isinstance(kind, types.BaseTuple):
        parts = tuple(_widened(part) for part in kind)
        return types.BaseTuple.from_types(parts, getattr(kind, "instance_class", None))
    if isinstance(kind, types.Number):
        return _OF[types.unliteral(kind)]
    return kind


def _part(builder: ir.IRBuilder, value: ir.Value, path: tuple[int, ...]) -> ir.Value:
    return builder.extract_value(value, path) if path else value


def _filled(
    context: Any, builder: ir.IRBuilder, kind: types.Type, values: Iterator[ir.Value]
) -> ir.Value:
    """Build a nested tuple of type `kind` from an iterator of its leaves."""
    if not isinstance(kind, types.BaseTuple):
        return context.get_dummy_value() if kind is types.none else next(values)
    parts = [_filled(context, builder, part, values) for part in kind]
    return context.make_tuple(builder, kind, parts)


def widen(value: Value, sample: object) -> Value:
    """Put every number of a nested tuple into all lanes if `sample` is lanes, so that types agree.

    Beside a plain `sample`, and for lanes, booleans and None, nothing changes.
    """
    return value


@intrinsic
def lanes_widen(typingctx: Any, value: types.Type, sample: types.Type) -> Typed:
    """`widen` in compiled code."""
    kind = _widened(value) if isinstance(sample, Lanes) else value

    def emit(context: Any, builder: ir.IRBuilder, sig: Any, args: list[ir.Value]) -> ir.Value:
        if kind == value:
            return args[0]
        wide = (
            context.cast(builder, _part(builder, args[0], path), leaf, _widened(leaf))
            for path, leaf in _leaves(value)
        )
        return _filled(context, builder, kind, wide)

    return kind(value, sample), emit


def _row(
    context: Any,
    builder: ir.IRBuilder,
    array_type: types.Array,
    array: ir.Value,
    row: int,
    vector: ir.Type,
) -> ir.Value:
    """Return the address of a number, or of LANES, in a row of a C-contiguous array."""
    array = context.make_array(array_type)(context, builder, array)
    shape = cgutils.unpack_tuple(builder, array.shape)
    if len(shape) == 1:
        return builder.gep(array.data, [ir.Constant(shape[0].type, row)])
    place = builder.gep(array.data, [builder.mul(shape[1], ir.Constant(shape[1].type, row))])
    return builder.bitcast(place, vector.as_pointer())


def load(like: Value, array: Array) -> Value:
    """Fill a nested tuple `like` this with numbers or lanes from successive rows of `array`."""
    numbers = iter(array.reshape(len(array), -1)[:, 0].tolist())

    def filled(part: Any) -> Any:
        if not isinstance(part, tuple):
            return None if part is None else next(numbers)
        parts = [filled(inner) for inner in part]
        return type(part)(*parts) if hasattr(part, "_fields") else tuple(parts)

    return cast(Value, filled(like))


@intrinsic
def lanes_load(typingctx: Any, like: types.Type, array: types.Array) -> Typed:
    """`load` in compiled code."""
    kind, filed = (_widened(like), FLOATS) if array.ndim == 2 else (like, types.float64)

    def emit(context: Any, builder: ir.IRBuilder, sig: Any, args: list[ir.Value]) -> ir.Value:
        vector = context.get_value_type(filed)

        def values() -> Iterator[ir.Value]:
            for row, (_, leaf) in enumerate(_leaves(kind)):
                place = _row(context, builder, array, args[1], row, vector)
                number = builder.load(place, align=8)
                whole = leaf != filed  # an integer
                yield builder.fptosi(number, context.get_value_type(leaf)) if whole else number

        return _filled(context, builder, kind, values())

    return kind(like, array), emit


def store(array: Array, value: object) -> None:
    """Write a nested tuple, all numbers or lanes, to successive rows of a float `array`."""

    def leaves(part: object) -> Iterator[Any]:
        if not isinstance(part, tuple):
            yield part
            return
        for inner in part:
            yield from leaves(inner)

    array.reshape(len(array), -1)[:, 0] = [part for part in leaves(value) if part is not None]


@intrinsic
def lanes_store(typingctx: Any, array: types.Array, value: types.Type) -> Typed:
    """`store` in compiled code."""
    filed = FLOATS if array.ndim == 2 else types.float64

    def emit(context: Any, builder: ir.IRBuilder, sig: Any, args: list[ir.Value]) -> ir.Value:
        vector = context.get_value_type(filed)
        for row, (path, leaf) in enumerate(_leaves(value)):
            part = _part(builder, args[1], path)
            if leaf == INTEGERS:
                part = builder.sitofp(part, vector)
            elif leaf == BOOLEANS:
                part = builder.uitofp(part, vector)
            else:
                part = context.cast(builder, part, leaf, filed)
            builder.store(part, _row(context, builder, array, args[0], row, vector), align=8)
        return context.get_dummy_value()

    return types.none(array, value), emit


# without forceinline the vectors would go through memory at every call
@overload(widen, jit_options={"forceinline": True})
def _widen(value, sample):  # type: ignore[no-untyped-def]  # as in elementwise.py
    return lambda value, sample: lanes_widen(value, sample)


@overload(load, jit_options={"forceinline": True})
def _load(like, array):  # type: ignore[no-untyped-def]
    return lambda like, array: lanes_load(like, array)


@overload(store, jit_options={"forceinline": True})
def _store(array, value):  # type: ignore[no-untyped-def]
    return lambda array, value: lanes_store(array, value)


@overload(select)
def _select(condition, chosen, other):  # type: ignore[no-untyped-def]  # as in elementwise.py
    if condition == BOOLEANS:
        return lambda condition, chosen, other: lanes_select(condition, chosen, other)
    return None
