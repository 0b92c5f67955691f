"""One push from one sample to the next: the function that is batched, sharded and compiled.

In: a scene, parameters, a motion and the state. Out: the next state and the sampled signals.
Written for one push; `simulate.py` maps it over many.
"""

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.pushing import contact_solver
from mjx_inertia.pushing.motion import Motion
from mjx_inertia.pushing.parameters import PushParameters, resting_height, with_parameters
from mjx_inertia.pushing.quiet_mjx import mjx
from mjx_inertia.pushing.scene import Scene


@struct.dataclass
class State:
    """Simulation state of one push: positions, velocities and the solver's warm start."""

    qpos: Float[Array, "*n nq"]
    qvel: Float[Array, "*n nv"]
    qacc: Float[Array, "*n nv"]


@struct.dataclass
class Sample:
    """Signals of one sample, as in `PushRecord`; forces are means over the sampling interval."""

    force: Float[Array, "*n 2"]
    moment: Float[Array, "*n"]
    pose: Float[Array, "*n 3"]
    twist: Float[Array, "*n 3"]
    tip_position: Float[Array, "*n 2"]
    tip_velocity: Float[Array, "*n 2"]


def initial_state(scene: Scene, pose: Float[Array, "3"], tip_start: Float[Array, "2"]) -> State:
    """The object at rest in the table's surface at `pose` (x, y, yaw), the tip at its start."""
    nv = scene.model.nv
    dtype = scene.data.qpos.dtype
    height = jnp.full(1, resting_height(scene), dtype)
    if scene.planar:
        body = jnp.concatenate([pose[:2], height, pose[2:]])
    else:
        half = 0.5 * pose[2]
        turn = jnp.stack([jnp.cos(half), jnp.zeros(()), jnp.zeros(()), jnp.sin(half)])
        body = jnp.concatenate([pose[:2], height, turn])
    qpos = jnp.concatenate([body, tip_start]).astype(dtype)
    return State(qpos=qpos, qvel=jnp.zeros(nv, dtype), qacc=jnp.zeros(nv, dtype))


def forward(scene: Scene, model: mjx.Model, state: State) -> mjx.Data:
    """Accelerations and contact forces at a state, by MJX's stages and our contact solver."""
    data = scene.data.replace(qpos=state.qpos, qvel=state.qvel, qacc_warmstart=state.qacc)
    data = mjx.com_pos(model, mjx.kinematics(model, data))
    data = mjx.crb(model, data)
    data = mjx.make_constraint(model, mjx.collision(model, data))
    data = mjx.rne(model, mjx.com_vel(model, data))
    settings = scene.settings
    return contact_solver.solve(
        model,
        data,
        -data.qfrc_bias,
        prescribed=scene.tip_dofs,
        iterations=settings.solver_iterations,
        line_search=settings.line_search,
    )


def _tip_wrench(scene: Scene, data: mjx.Data) -> tuple[Float[Array, "2"], Float[Array, ""]]:
    """Force of the tip on the object (world) and its moment about the object-frame origin."""
    jacobian, (x, y) = data._impl.efc_J, scene.tip_dofs
    touches = (jacobian[:, x] != 0) | (jacobian[:, y] != 0)
    force = jnp.where(touches, data._impl.efc_force, 0.0)
    qfrc = (jacobian * force[:, None]).sum(0)
    return -jnp.stack([qfrc[x], qfrc[y]]), qfrc[x - 1]  # yaw comes before the tip


def _pose(scene: Scene, state: State) -> Float[Array, "3"]:
    q = state.qpos
    if scene.planar:
        return jnp.stack([q[0], q[1], q[3]])
    w, x, y, z = q[3], q[4], q[5], q[6]
    yaw = jnp.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return jnp.stack([q[0], q[1], yaw])


def _step(scene: Scene, model: mjx.Model, state: State, tip: Array) -> tuple[State, Array, Array]:
    state = state.replace(qvel=state.qvel.at[np.array(scene.tip_dofs)].set(tip))
    data = forward(scene, model, state)
    force, moment = _tip_wrench(scene, data)
    warm = data.qacc
    data = mjx.euler(model, data.replace(act_dot=jnp.zeros(0, data.qacc.dtype)))
    return State(qpos=data.qpos, qvel=data.qvel, qacc=warm), force, moment


def rollout(
    scene: Scene,
    parameters: PushParameters,
    motion: Motion,
    state: State,
    first_sample: Int[Array, ""],
    samples: int,
) -> tuple[State, Sample]:
    """Simulates `samples` samples of one push.

    Args:
      scene: the compiled scene.
      parameters: of this push.
      motion: of its tip.
      state: at the start.
      first_sample: index of the first sample in the push.
      samples: how many.

    Returns:
      The state at the end and the signals, (samples, ...).
    """
    model = with_parameters(scene, parameters)
    step, substeps = scene.settings.timestep, scene.settings.substeps

    def sample(state: State, index: Int[Array, ""]) -> tuple[State, Sample]:
        def substep(carry: tuple, i: Int[Array, ""]) -> tuple[tuple, None]:
            state, force, moment = carry
            time = (index * substeps + i) * step
            tip = motion.velocity(time, step).astype(state.qvel.dtype)
            state, f, m = _step(scene, model, state, tip)
            return (state, force + f / substeps, moment + m / substeps), None

        zero = jnp.zeros((), state.qpos.dtype)
        (state, force, moment), _ = jax.lax.scan(
            substep, (state, jnp.zeros(2, zero.dtype), zero), jnp.arange(substeps)
        )
        v, tip = state.qvel, np.array(scene.tip_dofs)
        pose = _pose(scene, state)
        spin = v[3] if scene.planar else v[5]  # an upright object turns about its own z axis
        return state, Sample(
            force=force,
            moment=moment,
            pose=pose,
            twist=jnp.stack([v[0], v[1], spin]),
            tip_position=state.qpos[tip - scene.model.nv],
            tip_velocity=v[tip],
        )

    return jax.lax.scan(sample, state, first_sample + jnp.arange(samples))
