"""Named tuples of arrays that compiled functions hand to each other as one pointer.

To the compiler a tuple of arrays is all of their fields, seven to eleven numbers each, handed over one by
one at every call: sixty arrays are six hundred arguments, and much of what there is to compile.  Tuples
never change, so that a pointer to where a call from Python has put their fields serves as well; what is
loaded through it counts as constant.  A field is read by a function of the intermediate language, one line
where it is read instead of some forty: a third of what there was to write and to parse.
"""

from __future__ import annotations

from typing import Any, TypeVar

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, models, register_model, typeof_impl, unbox

Class = TypeVar("Class", bound=type)


class Reference(types.Type):
    """A pointer to the fields of a named tuple."""

    def __init__(self, cls: Any, kinds: tuple[Any, ...]) -> None:
        self.cls, self.kinds = cls, kinds
        super().__init__(name=f"{cls.__module__}.{cls.__qualname__}({', '.join(map(str, kinds))})")


@register_model(Reference)
class _ReferenceModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.IntType(8).as_pointer())


def _layout(context: Any, kind: Reference) -> Any:
    """What a reference leads to."""
    return ir.LiteralStructType([context.get_value_type(field) for field in kind.kinds])


@infer_getattr
class _Fields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, kind: Any, name: str) -> Any:
        return kind.kinds[kind.cls._fields.index(name)] if name in kind.cls._fields else None


@lower_getattr_generic(Reference)
def _field(context: Any, builder: Any, kind: Any, pointer: Any, name: str) -> Any:
    index = kind.cls._fields.index(name)
    function = _reader(context, builder.module, kind, index)
    return impl_ret_borrowed(context, builder, kind.kinds[index], builder.call(function, [pointer]))


def _reader(context: Any, module: Any, kind: Reference, index: int) -> Any:
    """The function that reads a field, of a module."""
    layout = _layout(context, kind)
    symbol = f"field {index} of {kind.cls.__qualname__} {hash(layout)}"
    if symbol in module.globals:
        return module.globals[symbol]
    signature = ir.FunctionType(layout.elements[index], [ir.IntType(8).as_pointer()])
    function = ir.Function(module, signature, symbol)
    function.linkage = "internal"
    function.attributes.add("alwaysinline")
    builder = ir.IRBuilder(function.append_basic_block())
    whole = builder.bitcast(function.args[0], layout.as_pointer())
    builder.ret(_loaded(builder, cgutils.gep_inbounds(builder, whole, 0, index)))
    return function


def _loaded(builder: Any, pointer: Any) -> Any:
    """What a pointer leads to, number by number: each of them is constant to the compiler."""
    of = pointer.type.pointee
    if isinstance(of, ir.LiteralStructType | ir.ArrayType):
        whole = ir.Constant(of, ir.Undefined)
        for i in range(len(of.elements) if isinstance(of, ir.LiteralStructType) else of.count):
            part = _loaded(builder, cgutils.gep_inbounds(builder, pointer, 0, i))
            whole = builder.insert_value(whole, part, i)
        return whole
    value = builder.load(pointer)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


@unbox(Reference)
def _from_python(kind: Any, obj: Any, c: Any) -> Any:
    """The fields, where the call from Python has its own memory, and a pointer to them."""
    pointer = cgutils.alloca_once(c.builder, _layout(c.context, kind))
    fields = [c.unbox(field, c.pyapi.tuple_getitem(obj, i)) for i, field in enumerate(kind.kinds)]
    wrong = cgutils.false_bit
    for i, field in enumerate(fields):
        c.builder.store(field.value, cgutils.gep_inbounds(c.builder, pointer, 0, i))
        wrong = c.builder.or_(wrong, field.is_error)

    def cleanup() -> None:
        for field in fields:
            if field.cleanup is not None:
                field.cleanup()

    whole = c.builder.bitcast(pointer, ir.IntType(8).as_pointer())
    return NativeValue(whole, is_error=wrong, cleanup=cleanup)


def by_reference(cls: Class) -> Class:
    """A decorator of a named tuple's class: compiled code hands it on as a pointer."""

    @typeof_impl.register(cls)
    def _kind(value: Any, context: Any) -> Any:
        return Reference(cls, tuple(typeof_impl(field, context) for field in value))

    return cls
