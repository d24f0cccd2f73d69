"""Named views of the flat arrays, made of the tables that say what their parts are (`layout.py`, `plan.py`)."""

import os
from collections import namedtuple
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

from .layout import ROW, SCRATCH, STATE, Shapes, Size
from .plan import OTHERS, WHOLE, MethodPlan, Plan


@intrinsic
def part(_, flat, start, shape):
    """An array of this shape from flat[start] on, which lives only as long as who called keeps the memory.

    References to it are not counted: to count those to the parts of a plan and a state, again and again, took more than
    half the time of a sample.
    """

    def generate(context, builder, signature, arguments):
        memory = context.make_array(signature.args[0])(context, builder, arguments[0])
        lengths = cgutils.unpack_tuple(builder, arguments[2])
        item = context.get_constant(types.intp, 8)
        strides = [item]
        for length in reversed(lengths[1:]):
            strides.insert(0, builder.mul(strides[0], length))
        view = context.make_array(signature.return_type)(context, builder)
        data = builder.gep(memory.data, [arguments[1]])
        populate_array(view, data=data, shape=lengths, strides=strides, itemsize=item, meminfo=None)
        return view._getvalue()

    return types.Array(flat.dtype, len(shape), "C")(flat, types.intp, types.UniTuple(types.intp, len(shape))), generate


def part_in_python(flat: np.ndarray, start: int, shape: tuple[int, ...]) -> np.ndarray:
    """The same where nothing is compiled."""
    return flat[start : start + int(np.prod(shape))].reshape(shape)


def views_of(views: type, new: bool = False, **arrays: Shapes) -> Callable[..., Any]:
    """A compiled function of flat arrays and a Size that gives a named tuple of views of their parts.

    new: it makes the arrays as well, of zeros. numba can neither loop over views of different shapes nor make a named
    tuple of names that it is told: it is given the lines that one would write.
    """
    lines, parts = [], []
    for array, shapes in arrays.items():
        places = [f"{array}0 = 0"]
        for k, (name, axes) in enumerate(shapes.items()):
            lengths = [str(axis) if isinstance(axis, int) else f"n.{axis}" for axis in axes]
            places.append(f"{array}{k + 1} = {array}{k} + {' * '.join(lengths)}")
            parts.append(f"{name}=part({array}, {array}{k}, ({', '.join(lengths)},))")
        lines += places
        if new:  # it is one of the parts, so that it lives as long as they do
            lines.append(f"{array} = zeros({array}{len(shapes)})")
            parts.append(f"{array}={array}")
    head = ", ".join(["n"] if new else [*arrays, "n"])
    code = "\n    ".join([f"def cut({head}):", *lines, f"return Views({', '.join(parts)})"])
    compiles = os.environ.get("NUMBA_DISABLE_JIT", "0") == "0"
    names: dict[str, Any] = {"Views": views, "zeros": np.zeros, "part": part if compiles else part_in_python}
    exec(code, names)
    return njit(inline="always")(names["cut"])


plan_views = views_of(Plan, whole=WHOLE, others=OTHERS)
row_views = views_of(namedtuple("RowViews", ROW), row=ROW)
state_views = views_of(namedtuple("StateViews", STATE), state=STATE)
scratch_views = views_of(namedtuple("ScratchViews", [*SCRATCH, "scratch"]), new=True, scratch=SCRATCH)


@njit(cache=True, inline="always")
def size_of(whole):
    return Size(whole[0], whole[1], whole[2], whole[3], whole[4], whole[5], whole[6], whole[7], whole[8], whole[9])


@njit(cache=True, inline="always")
def method_of(others):
    m = others
    return MethodPlan(m[0] != 0.0, m[1] != 0.0, m[2], m[3], m[4], m[5], m[6], m[7], int(m[8]), m[9])
