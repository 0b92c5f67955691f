"""A manoeuvre from its start to its end: where everything is at any time, and what moves it.

In: a manoeuvre and a decision. Out: `ManoeuvrePath` at shares of the duration, for the replay in
MuJoCo and for drawings. Costs read `Course` instead, at the few nodes of a quadrature.
"""

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Array, Float
from numpy import ndarray

from mjx_inertia.space.base_attitude import attitudes
from mjx_inertia.space.dual_arm import hand_wrenches, shared_load_torques
from mjx_inertia.space.instant import Node, node
from mjx_inertia.space.manoeuvre import Manoeuvre, base_at, motion_at
from mjx_inertia.space.trajectory import JointMotion
from mjx_inertia.spatial import AnyArray, Pose


@struct.dataclass
class ManoeuvrePath:
    """A manoeuvre at m times."""

    time: Float[AnyArray, " m"]  # s
    motion: JointMotion  # of the joints
    nodes: Node  # what the manoeuvre's model of momentum says of each time
    # of both hands on the object by that model, without squeezing it; in the base's axes about the
    # hands' origins, N and N m
    hand_wrenches: Float[AnyArray, "m 2 k"]
    # of the joints that moves robot and object so that the hands share the load, N m (N); with the
    # object's momentum, whatever the model
    torque: Float[AnyArray, "m n"]
    T_world_base: Pose  # the base
    T_world_obj: Pose  # the object

    def __getitem__(self, times: slice) -> "ManoeuvrePath":
        """The manoeuvre at some of its times."""
        return jax.tree.map(lambda x: x[times], self)


def path(
    manoeuvre: Manoeuvre,
    coefficients: Float[AnyArray, " c"],
    tau: Float[ndarray, " m"],
    total: bool = True,
) -> ManoeuvrePath:
    """The manoeuvre at shares `tau` of its duration, ascending from 0, in NumPy's arrays.

    Args:
      manoeuvre: what is to be done.
      coefficients: of a decision, as of `course`.
      tau: shares of the duration.
      total: with the nodes' total wrench, see `node`.

    Raises:
      ValueError: shares that do not ascend within 0 and 1, or coefficients that are not finite.
    """
    if not (np.all(np.diff(tau) > 0.0) and tau[0] >= 0.0 and tau[-1] <= 1.0):
        raise ValueError(
            f"`tau` must ascend from 0 to 1 at most; it goes from {tau[0]} to {tau[-1]}"
        )
    if not np.all(np.isfinite(coefficients)):
        raise ValueError(f"`coefficients` {np.asarray(coefficients).tolist()} are not all finite")
    # it runs once: compiling it well would take longer than running it
    options = {"xla_backend_optimization_level": 0, "xla_llvm_disable_expensive_passes": True}
    on_cpu = jax.default_backend() == "cpu"
    run = jax.jit(
        lambda c: _path(manoeuvre, c, tau, total), compiler_options=options if on_cpu else None
    )
    return jax.tree.map(np.asarray, run(jnp.asarray(coefficients, jnp.result_type(float))))


def _path(
    manoeuvre: Manoeuvre, coefficients: Float[Array, " c"], tau: Float[ndarray, " m"], total: bool
) -> ManoeuvrePath:
    m, robot, capture = manoeuvre, manoeuvre.robot, manoeuvre.capture
    count, every = len(tau), np.append(tau, m.rule.nodes)
    order = np.argsort(every)  # joints that follow do so from one time to the next
    motion = motion_at(m, every[order], coefficients)
    motion = jax.tree.map(lambda x: x[np.argsort(order)], motion)

    def loads(
        q: Float[Array, " n"], qd: Float[Array, " n"], qdd: Float[Array, " n"]
    ) -> tuple[Node, Float[Array, "2 k"], Float[Array, " n"]]:
        instant = node(robot, capture, q, qd, qdd, with_total=total)
        hands = hand_wrenches(robot, capture, q, instant)
        torque = shared_load_torques(robot, q, (qd, qdd), instant, hands)
        if m.momentum != "system":
            instant = node(robot, capture, q, qd, qdd, m.momentum, total)
            hands = hand_wrenches(robot, capture, q, instant)
        return instant, hands, torque

    signals = jax.vmap(loads)(motion.q, motion.qd, motion.qdd)
    omega = _angular(signals[0].base_twist[count:])
    motion, (nodes, hands, torque) = jax.tree.map(lambda x: x[:count], (motion, signals))
    rotation = attitudes(omega, m.duration, tau)
    T_world_base = jax.vmap(lambda R, q: base_at(m, R, q))(rotation, motion.q)
    T_base_obj = Pose(nodes.object_rotation, nodes.object_place)
    time = jnp.asarray(tau * m.duration, coefficients.dtype)
    return ManoeuvrePath(
        time, motion, nodes, hands, torque, T_world_base, T_world_base @ T_base_obj
    )


def _angular(twist: Float[Array, "n k"]) -> Float[Array, "n 3"]:
    if twist.shape[1] == 3:
        return jnp.zeros_like(twist).at[:, 2].set(twist[:, 2])
    return twist[:, 3:]
