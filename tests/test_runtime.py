"""LAPACK on a CPU: batches of matrices give what NumPy gives, and programs that call it end."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

ROUTINES = {
    "cholesky": (jnp.linalg.cholesky, np.linalg.cholesky),
    "eigenvalues": (jnp.linalg.eigvalsh, np.linalg.eigvalsh),
    "inverse": (jnp.linalg.inv, np.linalg.inv),
    "singular values": (
        lambda a: jnp.linalg.svd(a, compute_uv=False),
        lambda a: np.linalg.svd(a, compute_uv=False),
    ),
    "qr": (lambda a: jnp.abs(jnp.linalg.qr(a)[1]), lambda a: np.abs(np.linalg.qr(a)[1])),
    "solve": (lambda a: jnp.linalg.solve(a, a[..., :1]), lambda a: np.linalg.solve(a, a[..., :1])),
}


def symmetric(*shape):
    a = np.random.default_rng(0).normal(size=shape)
    return a @ np.swapaxes(a, -1, -2) + shape[-1] * np.eye(shape[-1])


@pytest.mark.parametrize("name", ROUTINES)
@pytest.mark.parametrize("batch", [(), (1,), (5,), (2, 3), (0,)])
def test_a_batch_of_matrices_gives_what_numpy_gives(name, batch):
    ours, reference = ROUTINES[name]
    a = symmetric(*batch, 4, 4)
    with jax.enable_x64(True):
        np.testing.assert_allclose(jax.jit(ours)(a), reference(a), rtol=1e-12, atol=1e-12)


def test_derivatives_of_a_batch():
    a = symmetric(3, 4, 4)
    with jax.enable_x64(True):
        gradient = jax.jit(jax.grad(lambda a: jnp.sum(jnp.log(jnp.linalg.eigvalsh(a)))))(a)
        np.testing.assert_allclose(gradient, np.linalg.inv(a), rtol=1e-10, atol=1e-12)


# Several batched calls that do not depend on each other: XLA starts them at the same time, and with
# JAX's own lowering they wait for each other for ever in a pool of two threads.
ON_EVERY_DEVICE = """
import os, sys
os.environ["NPROC"] = "2"  # threads of XLA's pool, whatever this machine has
import jax, jax.numpy as jnp, numpy as np
from jax.sharding import Mesh, PartitionSpec
from mjx_inertia import runtime
runtime.configure(int(sys.argv[1]), float64=True)

def body(a):
    def step(a, _):
        solved = sum(jax.vmap(jnp.linalg.solve)(k * a, a[:, 0]).sum() for k in (1.0, 1.1, 1.2, 1.3))
        others = (jnp.linalg.eigh(a)[0], jnp.linalg.cholesky(a), jnp.linalg.inv(a))
        return a + 1e-9 * (solved + sum(x.sum() for x in others)), None
    return jax.lax.scan(step, a, None, length=60)[0]

split = PartitionSpec("x")
mesh = Mesh(np.array(jax.devices()), "x")
run = jax.jit(jax.shard_map(body, mesh=mesh, in_specs=split, out_specs=split, check_vma=False))
a = np.random.default_rng(0).normal(size=(128, 16, 16))
a = a @ a.transpose(0, 2, 1) + 16 * np.eye(16)
for _ in range(5):
    run(a).block_until_ready()
assert len(jax.devices()) == int(sys.argv[1])
"""


@pytest.mark.long
@pytest.mark.parametrize("devices", ["1", "2"])
def test_programs_that_call_lapack_end(devices):
    run = subprocess.run([sys.executable, "-c", ON_EVERY_DEVICE, devices], timeout=200, check=False)
    assert run.returncode == 0
