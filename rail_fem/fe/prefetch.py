"""Cache lines asked for ahead of their use. Elements lie block after block in memory and a block is computed for some
microseconds: what the next one needs can come meanwhile. Changes no number.
"""

from __future__ import annotations

from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic

from kernel_cache import njit

NUMBERS, INDICES = 8, 16  # of 64 and of 32 bits to a line of 64 bytes
READ, SECOND_CACHE, DATA = 0, 2, 1  # as llvm.prefetch wants them; the first cache is full of the block at hand

if config.DISABLE_JIT:

    def ask_for(array, index):
        """Nothing to be done where nothing is compiled."""

else:

    @intrinsic
    def ask_for(typing_context, array, index):
        """The cache line of array[index], an array (n,) without gaps."""

        def generate(context, builder, signature, arguments):
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            address = builder.bitcast(builder.gep(data, [arguments[1]]), ir.IntType(8).as_pointer())
            word = ir.IntType(32)
            function = builder.module.declare_intrinsic(
                "llvm.prefetch", [address.type], ir.FunctionType(ir.VoidType(), [address.type, word, word, word])
            )
            builder.call(function, [address, *(ir.Constant(word, n) for n in (READ, SECOND_CACHE, DATA))])
            return context.get_dummy_value()

        return types.void(array, types.intp), generate


@njit(forceinline=True, error_model="numpy")
def fetch(array, first, count, each):
    """Entries first..first+count-1 of an array (n,), as far as it has them; `each` of them lie in a line."""
    for k in range(first, min(first + count, array.size), each):
        ask_for(array, k)
