"""An identity that stops XLA's CPU compiler from computing one thing many times.

The compiler repeats cheap operations inside every loop that reads their result, up to fifteen
times over, and nests such repetitions; `jax.lax.optimization_barrier` is gone before it decides.
Divisions it never repeats, so this identity is lowered to one, in derivatives as well.
In: an array. Out: the same array.
"""

import jax.numpy as jnp
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array

_once = Primitive("computed_once")
_once.def_impl(lambda x: x)
_once.def_abstract_eval(lambda x: x)
ad.deflinear2(_once, lambda cotangent, _: [_once.bind(cotangent)])
batching.defvectorized(_once)
mlir.register_lowering(
    _once,
    # a one that the compiler does not see through
    mlir.lower_fun(
        lambda x: x / jnp.where(jnp.isnan(x), x.dtype.type(2), x.dtype.type(1)),
        multiple_results=False,
    ),
)


def computed_once(x: Array) -> Array:
    """x, and its derivatives, computed in one place wherever they are used."""
    return _once.bind(x)
