"""What differs from push to push in one scene, and how it enters the model.

In: a `Scene` and `PushParameters`. Out: an MJX model (traced, for the simulation) or a recompiled
MuJoCo model (for the oracle) with these parameters.
"""

import jax.numpy as jnp
import mujoco
import numpy as np
from flax import struct
from jaxtyping import Array, Float

from mjx_inertia.objects import ObjectModel, friction_radius
from mjx_inertia.pushing.quiet_mjx import mjx
from mjx_inertia.pushing.scene import Scene, build_spec
from mjx_inertia.pushing.settings import FLOOR_SOLIMP, FLOOR_SOLREF, GRAVITY
from mjx_inertia.spatial import AnyArray


@struct.dataclass
class PushParameters:
    """Physical parameters of one push (or, with a leading axis, of many)."""

    mass: Float[AnyArray, "*n"]  # kg
    # principal moments about the CoM along the object's axes, kg m²; the planar tables use I_zz
    # alone
    inertia: Float[AnyArray, "*n 3"]
    com: Float[AnyArray, "*n 3"]  # CoM in the object frame, m
    half_extents: Float[AnyArray, "*n 3"]  # of a box, m; without effect on other objects
    friction: Float[AnyArray, "*n"]  # μ between object and table
    # c of the limit surface, m (errata 5); table `limit_surface` only
    friction_radius: Float[AnyArray, "*n"]
    tip_friction: Float[AnyArray, "*n"]  # between tip and object
    # of their contact (`solref`), s; at least two simulation steps
    tip_time_constant: Float[AnyArray, "*n"]
    # what the tip meets of this object if it is not that of the scene, m (`plan_view`); tables on
    # which objects stay upright only
    polygons: Float[AnyArray, "*n m k 2"] | None = None


def object_parameters(
    obj: ObjectModel,
    friction: float,
    tip_friction: float = 0.3,
    tip_time_constant: float = 0.02,
    radius: float | None = None,
) -> PushParameters:
    """Parameters of one object as its model says.

    c of the limit surface is `radius` (m), or that of uniform pressure on the object's support.
    """
    com = np.asarray(obj.inertial.com)
    if radius is None:
        radius = float(friction_radius(obj.support, com[:2]))
    return PushParameters(
        mass=jnp.asarray(obj.inertial.mass, float),
        inertia=jnp.diag(jnp.asarray(obj.inertial.inertia, float)),
        com=jnp.asarray(com, float),
        half_extents=jnp.asarray(obj.half_extents, float),
        friction=jnp.asarray(friction, float),
        friction_radius=jnp.asarray(radius, float),
        tip_friction=jnp.asarray(tip_friction, float),
        tip_time_constant=jnp.asarray(tip_time_constant, float),
    )


def _inverse_weights(
    scene: Scene, p: PushParameters
) -> tuple[Float[Array, "2"], Float[Array, " d"]]:
    """`body_invweight0` and `dof_invweight0` of the object (engine_setconst.c, set0)."""
    c, inverse = p.com, 1.0 / p.inertia
    if scene.planar:
        body = jnp.array([1.0 / p.mass, inverse[2] / 3.0])
        slide = 1.0 / p.mass + jnp.array([c[1] ** 2, c[0] ** 2, 0.0]) * inverse[2]
        return body, jnp.append(slide, inverse[2])
    # M⁻¹ of a free joint at the frame's origin: linear block 1/m - [c] I⁻¹ [c]
    lever = inverse @ (jnp.sum(c * c) - c * c)
    linear, angular = 1.0 / p.mass + lever / 3.0, inverse.mean()
    body = jnp.array([1.0 / p.mass, angular])
    return body, jnp.concatenate([jnp.full(3, linear), jnp.full(3, angular)])


def _pair_friction(scene: Scene, p: PushParameters) -> Float[Array, "npair 5"]:
    friction = jnp.zeros((scene.model.npair, 5))
    table = jnp.array([p.friction, p.friction, p.friction * p.friction_radius, 0.0, 0.0])
    tip = jnp.array([p.tip_friction, p.tip_friction, 0.0, 0.0, 0.0])
    return friction.at[scene.floor_pairs].set(table).at[scene.tip_pairs].set(tip)


def feet_offsets(scene: Scene, p: PushParameters) -> Float[Array, "feet 2"]:
    """Where the feet stand, m from the object frame's origin along its axes.

    One foot stands under the CoM (table `limit_surface`), several are spread over the footprint.
    """
    if scene.settings.table == "limit_surface":
        return jnp.asarray(p.com)[None, :2]
    spread = jnp.asarray(scene.feet_fraction) * p.half_extents[:2]
    return jnp.asarray(scene.object_model.center[:2] + spread)


def _feet_position(scene: Scene, p: PushParameters) -> Float[Array, "feet 3"]:
    height = jnp.full((len(scene.feet), 1), scene.model.geom_size[scene.feet[0], 0])
    return jnp.concatenate([feet_offsets(scene, p), height], 1)


def with_parameters(scene: Scene, p: PushParameters) -> mjx.Model:
    """The scene's MJX model with the parameters of one push, derived fields included.

    MJX has no `mj_setConst`: the fields that MuJoCo derives from mass and inertia and that contact
    forces are scaled with are computed here.
    """
    # mass, CoM and inertia, and the fields that MuJoCo derives from them
    m = scene.mjx_model
    body, n_dof = scene.body, scene.model.nv - 2
    body_weight, dof_weight = _inverse_weights(scene, p)
    solref = m.pair_solref.at[scene.tip_pairs, 0].set(p.tip_time_constant)
    changes = {
        "body_mass": m.body_mass.at[body].set(p.mass),
        "body_subtreemass": m.body_subtreemass.at[body]
        .set(p.mass)
        .at[0]
        .set(p.mass + float(scene.model.body_mass[scene.tip_body])),
        "body_inertia": m.body_inertia.at[body].set(p.inertia),
        "body_ipos": m.body_ipos.at[body].set(p.com),
        "body_invweight0": m.body_invweight0.at[body].set(body_weight),
        "dof_invweight0": m.dof_invweight0.at[:n_dof].set(dof_weight),
        "pair_friction": _pair_friction(scene, p).astype(m.pair_friction.dtype),
        "pair_solref": solref,
    }
    # geometry: the box and where the feet stand
    position, size = m.geom_pos, m.geom_size
    if scene.object_model.is_box:
        size = size.at[scene.hull[0]].set(p.half_extents)
        position = position.at[scene.hull[0], 2].set(p.half_extents[2])
    if len(scene.feet):
        position = position.at[scene.feet].set(_feet_position(scene, p))
    return m.replace(**changes, geom_size=size, geom_pos=position)


def recompile(scene: Scene, p: PushParameters) -> mujoco.MjModel:
    """The same parameters compiled by MuJoCo from the start: the oracle's model."""
    spec = build_spec(scene.object_model, scene.settings)
    # mass, CoM and inertia; geometry
    body = spec.body("object")
    body.mass, body.inertia, body.ipos = float(p.mass), np.asarray(p.inertia), np.asarray(p.com)
    if scene.object_model.is_box:
        hull = spec.geom("hull0")
        hull.size = np.asarray(p.half_extents)
        hull.pos = (*scene.object_model.center[:2], float(p.half_extents[2]))
    if len(scene.feet):
        for i, position in enumerate(np.asarray(_feet_position(scene, p))):
            spec.geom(f"foot{i}").pos = position
    # friction of tip and table
    mu, tip = float(p.friction), float(p.tip_friction)
    for pair in spec.pairs:
        if pair.name.startswith("tip"):
            pair.friction = (tip, tip, 0.0, 0.0, 0.0)
            pair.solref = (float(p.tip_time_constant), 1.0)
        else:
            pair.friction = (mu, mu, mu * float(p.friction_radius), 0.0, 0.0)
    return spec.compile()


def resting_height(scene: Scene) -> float:
    """How far the object's base sinks into the table at rest, m (negative): independent of mass.

    Solves m g = n D k d |z|, the static balance of n contacts of impedance d(z) and weight
    D = d / ((1 - d) w) with w = 1/m (MuJoCo documentation, "Solver parameters").
    """
    d_min, d_max, width, _, power = FLOOR_SOLIMP
    time_constant, damping = FLOOR_SOLREF
    stiffness = 1.0 / (d_max * time_constant * damping) ** 2
    contacts = 4 if scene.settings.table == "corners" else len(scene.feet)
    low, high = 0.0, width
    for _ in range(60):
        z = 0.5 * (low + high)
        x = z / width
        share = x**power / 0.5 ** (power - 1) if x < 0.5 else 1 - 2 * (1 - x) ** power
        d = min(max(d_min + share * (d_max - d_min), 1e-4), 0.9999)
        force = contacts * stiffness * z * d * d / (1 - d)
        low, high = (z, high) if force < GRAVITY else (low, z)
    return -low
