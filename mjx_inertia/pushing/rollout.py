"""One push from one sample to the next: the function that is batched, sharded and compiled.

In: a scene, parameters, a motion and the state. Out: the next state and the sampled signals.
Written for one push; `batched_simulation.py` maps it over many.
"""

import jax
import jax.numpy as jnp
from flax import struct
from jaxtyping import Array, Float, Int

from mjx_inertia.pushing import contact_solver
from mjx_inertia.pushing.closed_form import free_problem, integrate_rotation, planar_problem
from mjx_inertia.pushing.contact_problem import cone_forces, constraint_residual
from mjx_inertia.pushing.parameters import PushParameters, resting_height, with_parameters
from mjx_inertia.pushing.quiet_mjx import mjx
from mjx_inertia.pushing.record import Motion
from mjx_inertia.pushing.scene import Scene
from mjx_inertia.spatial.unrolled import Vector, computed_once


@struct.dataclass
class State:
    """Simulation state of one push: positions, velocities and the solver's warm start.

    One array for each coordinate, so that in a batch the values of one coordinate lie side by side.
    """

    qpos: Vector
    qvel: Vector
    qacc: Vector


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
    dtype = scene.data.qpos.dtype
    x, y, yaw = (jnp.asarray(pose[i], dtype) for i in range(3))
    zero = jnp.zeros_like(x)
    height = zero + resting_height(scene)
    turn = (yaw,) if scene.planar else (jnp.cos(0.5 * yaw), zero, zero, jnp.sin(0.5 * yaw))
    tip = (jnp.asarray(tip_start[i], dtype) for i in range(2))
    still = Vector((zero,) * scene.model.nv)
    return State(qpos=Vector((x, y, height, *turn, *tip)), qvel=still, qacc=still)


def _mjx_forward(scene: Scene, model: mjx.Model, state: State) -> tuple[Vector, Vector]:
    """Accelerations and the tip's wrench on the object, by MJX's stages and our contact solver."""
    # contact rows, mass matrix and bias forces
    qpos, qvel, qacc = (jnp.stack(x) for x in (state.qpos, state.qvel, state.qacc))
    data = scene.data.replace(qpos=qpos, qvel=qvel, qacc_warmstart=qacc)
    data = mjx.com_pos(model, mjx.kinematics(model, data))
    data = mjx.crb(model, data)
    data = mjx.make_constraint(model, mjx.collision(model, data))
    data = mjx.rne(model, mjx.com_vel(model, data))
    # accelerations; the tip's velocity is prescribed
    settings = scene.settings
    data = contact_solver.solve(
        model,
        data,
        -data.qfrc_bias,
        prescribed=scene.tip_dofs,
        iterations=settings.solver_iterations,
        line_search=settings.line_search,
    )
    # the tip's force is that of the rows that move it
    jacobian, (x, y) = data._impl.efc_J, scene.tip_dofs
    touches = (jacobian[:, x] != 0) | (jacobian[:, y] != 0)
    force = jnp.where(touches, data._impl.efc_force, 0.0)
    qfrc = (jacobian * force[:, None]).sum(0)
    acceleration = Vector(data.qacc[i] for i in range(scene.model.nv))
    return acceleration, Vector((-qfrc[x], -qfrc[y], qfrc[x - 1]))  # yaw comes before the tip


def _closed_form_forward(
    scene: Scene, parameters: PushParameters, state: State
) -> tuple[Vector, Vector]:
    """The same from the contact problem in closed form."""
    problem_at = planar_problem if scene.planar else free_problem
    problem = problem_at(scene, parameters, state.qpos, state.qvel)
    n, settings = len(problem.free), scene.settings
    a = contact_solver.minimiser(
        problem, state.qacc[:n], settings.solver_iterations, settings.line_search
    )
    tip = problem.constraints[0]
    force = computed_once(cone_forces(tip, constraint_residual(tip, a))[0])
    columns = tip.jacobian.T
    wrench = Vector((columns[i] @ force).sum() for i in (0, 1, n - 1))
    zero = jnp.zeros_like(wrench[0])  # the tip keeps its velocity
    return Vector((*a, zero, zero)), wrench


def _integrate(scene: Scene, state: State, acceleration: Vector) -> State:
    """One step of semi-implicit Euler integration."""
    step, q = scene.settings.timestep, state.qpos
    v = state.qvel + step * acceleration
    if scene.planar:
        q = q + step * v
    else:
        moved = Vector((*q[:3], *q[7:])) + step * Vector((*v[:3], *v[6:]))
        q = Vector((*moved[:3], *integrate_rotation(q[3:7], v[3:6], step), *moved[3:]))
    return State(qpos=q, qvel=v, qacc=acceleration)


def _pose(scene: Scene, state: State) -> Float[Array, "3"]:
    q = state.qpos
    if scene.planar:
        return jnp.stack([q[0], q[1], q[3]])
    w, x, y, z = q[3], q[4], q[5], q[6]
    yaw = jnp.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return jnp.stack([q[0], q[1], yaw])


def step(
    scene: Scene, parameters: PushParameters, state: State, tip_velocity: Float[Array, "2"]
) -> tuple[State, Vector]:
    """One time step while the tip moves at a given velocity (m/s, world).

    Returns:
      The next state, and what the tip does to the object: force (N, x and y, world) and moment
      about the object-frame origin (N m).
    """
    state = state.replace(qvel=Vector((*state.qvel[:-2], tip_velocity[0], tip_velocity[1])))
    if scene.has_closed_form:
        acceleration, wrench = _closed_form_forward(scene, parameters, state)
    else:
        model = with_parameters(scene, parameters)
        acceleration, wrench = _mjx_forward(scene, model, state)
    return _integrate(scene, state, acceleration), wrench


def rollout(
    scene: Scene,
    parameters: PushParameters,
    motion: Motion,
    state: State,
    first_sample: Int[Array, ""],
    samples: int,
) -> tuple[State, Sample]:
    """Simulates `samples` samples of one push, of which `first_sample` is the index of the first.

    Returns:
      The state at the end and the signals, (samples, ...).
    """
    timestep, substeps = scene.settings.timestep, scene.settings.substeps

    # a sample: time steps with the tip on its path, and what the sensors give at their end
    def sample(state: State, index: Int[Array, ""]) -> tuple[State, Sample]:
        def substep(carry: tuple, i: Int[Array, ""]) -> tuple[tuple, None]:
            state, total = carry
            time = (index * substeps + i) * timestep
            tip = motion.velocity(time, timestep).astype(state.qvel[0].dtype)
            state, wrench = step(scene, parameters, state, tip)
            return (state, total + wrench), None

        zero = jnp.zeros_like(state.qpos[0])
        (state, total), _ = jax.lax.scan(
            substep, (state, Vector((zero,) * 3)), jnp.arange(substeps)
        )
        v = state.qvel
        spin = v[3] if scene.planar else v[5]  # an upright object turns about its own z axis
        return state, Sample(
            force=jnp.stack(total[:2]) / substeps,
            moment=total[2] / substeps,
            pose=_pose(scene, state),
            twist=jnp.stack([v[0], v[1], spin]),
            tip_position=jnp.stack(state.qpos[-2:]),
            tip_velocity=jnp.stack(v[-2:]),
        )

    return jax.lax.scan(sample, state, first_sample + jnp.arange(samples))
