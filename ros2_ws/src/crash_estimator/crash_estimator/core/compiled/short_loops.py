"""For compiled functions whose loops are over a few parameters, equations and bodies."""

import os

from numba import types
from numba.extending import intrinsic


@intrinsic
def _keep_small(_):
    def generate(context, builder, _signature, _arguments):
        builder.function.attributes.add("optsize")
        return context.get_dummy_value()

    return types.none(), generate


def _nothing() -> None:
    """Where nothing is compiled."""


short_loops = _keep_small if os.environ.get("NUMBA_DISABLE_JIT", "0") == "0" else _nothing
"""Said at the head of such a function: LLVM is to keep its code small (`optsize`), whatever it is inlined into.

Loops of three to six steps that are unrolled and made of vectors all the same give a sample's code 150 kB, several
times the processor's first cache: a call per sample took a quarter longer, and a record a fifth.
"""
