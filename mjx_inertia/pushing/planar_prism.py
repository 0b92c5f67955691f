"""An object that slides upright on the table, met by the tip: dynamics and contacts in closed form.

The step of the same scene in MJX (tested to rounding), at a tenth of its operations: MJX's general
tree and collision code is most of what a batch of small scenes costs, above all with derivatives.
In: parameters, state. Out: the contact problem over x, y, z and yaw.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_inertia.pushing.contact_problem import Constraints, ContactProblem
from mjx_inertia.pushing.contact_rows import ContactLaw, contact_rows
from mjx_inertia.pushing.nearest import nearest_on_box, nearest_on_polygons
from mjx_inertia.pushing.parameters import PushParameters, feet_offsets
from mjx_inertia.pushing.scene import Scene
from mjx_inertia.pushing.settings import (
    FLOOR_SOLIMP,
    FLOOR_SOLREF,
    GRAVITY,
    TIP_SOLIMP,
    TIP_SOLREF_FRICTION,
)
from mjx_inertia.pushing.small_linalg import Vector, inner_product
from mjx_inertia.spatial.computed_once import computed_once


def tip_law(scene: Scene, p: PushParameters) -> ContactLaw:
    """Stiffness of the contact between tip and object."""
    solref = (p.tip_time_constant, 1.0)
    return ContactLaw(solref, TIP_SOLREF_FRICTION, TIP_SOLIMP, scene.settings.timestep)


def floor_law(scene: Scene) -> ContactLaw:
    """Stiffness of the contacts between object and table."""
    return ContactLaw(FLOOR_SOLREF, FLOOR_SOLREF, FLOOR_SOLIMP, scene.settings.timestep)


def _turn(yaw: tuple[Array, Array], x: Array, y: Array) -> tuple[Array, Array]:
    cosine, sine = yaw
    return cosine * x - sine * y, sine * x + cosine * y


def _nearest(
    scene: Scene, p: PushParameters, x: Array, y: Array
) -> tuple[Float[Array, " c"], list[Array]]:
    """Distance of the tip's centre from each piece of the object, and the inward normals there."""
    if p.polygons is None and scene.object_model.is_box:
        center = scene.object_model.center
        sides = (p.half_extents[0], p.half_extents[1])
        distance, normal = nearest_on_box((x - center[0], y - center[1]), sides)
        return distance[None], [n[None] for n in normal]
    polygons = scene.polygons if p.polygons is None else p.polygons
    assert polygons is not None  # a planar scene of an object that is no box
    return nearest_on_polygons((x, y), polygons)


def _tip_contact(
    scene: Scene,
    p: PushParameters,
    q: Vector,
    v: Vector,
    yaw: tuple[Array, Array],
) -> Constraints:
    inverse_yaw = (yaw[0], -yaw[1])
    x, y = _turn(inverse_yaw, q[4] - q[0], q[5] - q[1])
    radius = scene.settings.tip_radius
    distance, normal = _nearest(scene, p, x, y)
    distance = computed_once(distance)
    n_x, n_y = (computed_once(n) for n in _turn(yaw, *normal))
    middle = 0.5 * (distance + radius)  # contact: halfway between the two surfaces
    arm_x, arm_y = q[4] - q[0] + n_x * middle, q[5] - q[1] + n_y * middle
    zero, one = jnp.zeros_like(n_x), jnp.ones_like(n_x)
    jacobian = [
        [n_x, n_y, zero, arm_x * n_y - arm_y * n_x],
        [-n_y, n_x, zero, arm_x * n_x + arm_y * n_y],
        [zero, zero, one, zero],
    ]
    tip = [n_x * v[4] + n_y * v[5], n_x * v[5] - n_y * v[4], zero]
    velocity = [inner_product(row, v[:4]) - t for row, t in zip(jacobian, tip, strict=True)]
    return contact_rows(
        tip_law(scene, p),
        distance - radius,
        jacobian,
        velocity,
        [jnp.asarray(p.tip_friction)] * 2,
        1.0 / p.mass + float(scene.model.body_invweight0[scene.tip_body, 0]),
    )


def _floor_contacts(
    scene: Scene,
    p: PushParameters,
    q: Vector,
    v: Vector,
    yaw: tuple[Array, Array],
) -> Constraints:
    feet = feet_offsets(scene, p)
    x, y = _turn(yaw, feet[:, 0], feet[:, 1])
    zero, one = jnp.zeros_like(x), jnp.ones_like(x)
    jacobian = [[zero, zero, one, zero], [one, zero, zero, -y], [zero, one, zero, x]]
    friction = [jnp.asarray(p.friction)] * 2
    if scene.settings.table == "limit_surface":
        jacobian.append([zero, zero, zero, one])
        friction.append(jnp.asarray(p.friction * p.friction_radius))
    velocity = [inner_product(row, v[:4]) for row in jacobian]
    return contact_rows(floor_law(scene), q[2] * one, jacobian, velocity, friction, 1.0 / p.mass)


def planar_problem(scene: Scene, p: PushParameters, q: Vector, v: Vector) -> ContactProblem:
    """The contact problem at positions q and velocities v (x, y, z, yaw, tip x, tip y).

    Of its two kinds of constraints the first is the tip's.
    """
    yaw = (computed_once(jnp.cos(q[3])), computed_once(jnp.sin(q[3])))
    x, y = (computed_once(x) for x in _turn(yaw, p.com[0], p.com[1]))
    m, zero, spin = jnp.asarray(p.mass), jnp.zeros_like(q[0]), v[3]
    mass = [
        [m, zero, zero, -m * y],
        [zero, m, zero, m * x],
        [zero, zero, m, zero],
        [-m * y, m * x, zero, p.inertia[2] + m * (x * x + y * y)],
    ]
    centrifugal = m * spin * spin
    return ContactProblem(
        mass=mass,
        smooth=[centrifugal * x, centrifugal * y, -m * GRAVITY, zero],
        constraints=[_tip_contact(scene, p, q, v, yaw), _floor_contacts(scene, p, q, v, yaw)],
        free=(0, 1, 2, 3),
    )
