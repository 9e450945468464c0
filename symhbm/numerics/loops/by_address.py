"""Machine code that loops call by its address: other loops, LAPACK, functions of CasADi.

A loop that calls another one by its name is compiled together with it, which takes seconds for each
of them; by its address it is not, and one loop may call what is only known when it runs.
"""

import ctypes
from functools import cache
from typing import Any

from symhbm.numerics.machine_code import Foreign

FAILED = -100
"""Result of a loop that raised an exception."""
_EVALUATE = "_ZN6casadi21_function_buffer_evalEPv"
"""What evaluates a buffered function, in the library of CasADi."""


@Foreign
def call_loop() -> Any:
    """A loop at an ``address``, of a tuple of arguments, whose result is an integer."""
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic

    @intrinsic
    def call(typing: Any, address: Any, arguments: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            kinds, conventions = [*signature.args[1].types], context.call_conv
            kind = conventions.get_function_type(types.int64, kinds).as_pointer()
            values = cgutils.unpack_tuple(builder, given[1])
            target = builder.inttoptr(given[0], kind)
            ended, result = conventions.call_function(builder, target, types.int64, kinds, values)
            return builder.select(ended.is_error, ir.Constant(ir.IntType(64), FAILED), result)

        return types.int64(types.int64, arguments), build

    return call


@Foreign
def call_library() -> Any:
    """A function of a library at an ``address``, of a tuple of addresses, without a result."""
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic

    @intrinsic
    def call(typing: Any, address: Any, arguments: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            values = cgutils.unpack_tuple(builder, given[1])
            integer = ir.IntType(64)
            kind = ir.FunctionType(ir.VoidType(), [integer] * len(values)).as_pointer()
            builder.call(builder.inttoptr(given[0], kind), values)
            return context.get_dummy_value()

        return types.none(types.int64, arguments), build

    return call


@cache
def functions() -> tuple[int, int, int] | None:
    """Addresses of what evaluates a buffered function of CasADi, and of dgetrf and dgetrs.

    None where they have other names or integers here.
    """
    from casadi import _casadi  # type: ignore[attr-defined]
    from scipy.linalg import cython_lapack  # type: ignore[attr-defined]

    # Its own library: there may be another copy of the one behind it.
    evaluate = getattr(ctypes.CDLL(_casadi.__file__), _EVALUATE, None)
    capsules = [cython_lapack.__pyx_capi__[name] for name in ("dgetrf", "dgetrs")]
    if evaluate is None or not all(
        b"(int *" in _name(one).replace(b"char *, ", b"") for one in capsules
    ):
        return None
    factorise, solve = map(pointer, capsules)
    return int(ctypes.cast(evaluate, ctypes.c_void_p).value or 0), factorise, solve


def _name(capsule: Any) -> bytes:
    name = ctypes.pythonapi.PyCapsule_GetName
    name.restype, name.argtypes = ctypes.c_char_p, [ctypes.py_object]
    return name(capsule) or b""


def pointer(capsule: Any) -> int:
    """The address that a capsule of Python holds."""
    address = ctypes.pythonapi.PyCapsule_GetPointer
    address.restype, address.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return address(capsule, _name(capsule) or None)
