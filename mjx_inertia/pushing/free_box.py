"""A box that stands on its corners and moves freely: dynamics and contacts in closed form.

The counterpart of `planar_prism.py` for the table `corners`. Velocities are MuJoCo's: of the object
frame's origin in world axes, and angular in the object's own axes.
In: parameters, state. Out: the contact problem over the six degrees of freedom.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array

from mjx_inertia.pushing.contact_problem import Constraints, ContactProblem
from mjx_inertia.pushing.contact_rows import contact_rows
from mjx_inertia.pushing.nearest import nearest_on_box
from mjx_inertia.pushing.parameters import PushParameters
from mjx_inertia.pushing.planar_prism import floor_law, tip_law
from mjx_inertia.pushing.scene import Scene
from mjx_inertia.pushing.settings import GRAVITY
from mjx_inertia.pushing.small_linalg import Matrix, Vector, inner_product, matvec
from mjx_inertia.spatial.computed_once import computed_once


def _cross(a: Vector, b: Vector) -> list[Array]:
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def _transposed(matrix: Matrix) -> list[list[Array]]:
    return [list(column) for column in zip(*matrix, strict=True)]


def _rotation(quaternion: Vector) -> list[list[Array]]:
    """Rows of the rotation matrix of a unit quaternion (wxyz)."""
    w, x, y, z = quaternion
    return [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]


def integrate_rotation(quaternion: Vector, spin: Vector, step: float) -> list[Array]:
    """The orientation after a time step (s) at an angular velocity (object axes, rad/s)."""
    squared = inner_product(spin, spin)
    turns = squared > 0
    rate = jnp.sqrt(jnp.where(turns, squared, 1.0))
    half = 0.5 * step * jnp.where(turns, rate, 0.0)
    # sin(half) / rate, which tends to step / 2
    share = jnp.where(turns, jnp.sin(half) / rate, 0.5 * step)
    w, x, y, z = quaternion
    c, (i, j, k) = jnp.cos(half), (share * s for s in spin)
    turned = [
        w * c - x * i - y * j - z * k,
        w * i + x * c + y * k - z * j,
        w * j - x * k + y * c + z * i,
        w * k + x * j - y * i + z * c,
    ]
    scale = jax.lax.rsqrt(inner_product(turned, turned))
    return [scale * t for t in turned]


def _rows(directions: Matrix, lever: Vector, rotation: Matrix) -> list[list[Array]]:
    """Jacobian rows of the point at `lever` (object axes) along world directions."""
    inverse = _transposed(rotation)
    return [[*d, *_cross(lever, matvec(inverse, d))] for d in directions]


def _tip_contact(
    scene: Scene,
    p: PushParameters,
    q: Vector,
    v: Vector,
    rotation: Matrix,
) -> Constraints:
    center, radius = scene.object_model.center, scene.settings.tip_radius
    height = float(scene.model.body_pos[scene.tip_body, 2])
    inverse = _transposed(rotation)
    place = matvec(inverse, [q[7] - q[0], q[8] - q[1], height - q[2]])
    middle_of_box = (center[0], center[1], p.half_extents[2])
    distance, local = nearest_on_box(
        [x - c for x, c in zip(place, middle_of_box, strict=True)],
        [p.half_extents[i] for i in range(3)],
    )
    distance, local = computed_once(distance), [computed_once(n) for n in local]
    middle = 0.5 * (distance + radius)  # contact: halfway between the two surfaces
    lever = [x + n * middle for x, n in zip(place, local, strict=True)]
    lever = [computed_once(x) for x in lever]
    normal = [computed_once(n) for n in matvec(rotation, local)]
    level = jax.lax.rsqrt(normal[0] ** 2 + normal[1] ** 2)
    tangent = [-normal[1] * level, normal[0] * level, jnp.zeros_like(level)]
    directions = [normal, tangent, _cross(normal, tangent)]
    jacobian = _rows(directions, lever, rotation)
    moving = v[:6]
    velocity = [
        inner_product(row, moving) - (d[0] * v[6] + d[1] * v[7])
        for row, d in zip(jacobian, directions, strict=True)
    ]
    return contact_rows(
        tip_law(scene, p),
        (distance - radius)[None],
        [[column[None] for column in row] for row in jacobian],
        [u[None] for u in velocity],
        [jnp.asarray(p.tip_friction)] * 2,
        1.0 / p.mass + float(scene.model.body_invweight0[scene.tip_body, 0]),
    )


def _floor_contacts(
    scene: Scene,
    p: PushParameters,
    q: Vector,
    v: Vector,
    rotation: Matrix,
) -> Constraints:
    center = scene.object_model.center
    x = center[0] + jnp.array([1.0, -1.0, -1.0, 1.0]) * p.half_extents[0]
    y = center[1] + jnp.array([1.0, 1.0, -1.0, -1.0]) * p.half_extents[1]
    zero, one = jnp.zeros_like(x), jnp.ones_like(x)
    distance = computed_once(q[2] + rotation[2][0] * x + rotation[2][1] * y)
    # contact: halfway between corner and table, straight above or below the corner
    lever = [b - 0.5 * distance * r for b, r in zip([x, y, zero], rotation[2], strict=True)]
    directions = [[zero, zero, one], [one, zero, zero], [zero, one, zero]]
    jacobian = _rows(directions, lever, rotation)
    velocity = [inner_product(row, v[:6]) for row in jacobian]
    return contact_rows(
        floor_law(scene), distance, jacobian, velocity, [jnp.asarray(p.friction)] * 2, 1.0 / p.mass
    )


def free_problem(scene: Scene, p: PushParameters, q: Vector, v: Vector) -> ContactProblem:
    """The contact problem at positions q (x, y, z, quaternion, tip) and velocities v.

    Of its two kinds of constraints the first is the tip's.
    """
    rotation = [[computed_once(x) for x in row] for row in _rotation(q[3:7])]
    m, zero = jnp.asarray(p.mass), jnp.zeros_like(q[0])
    com, spin = [jnp.asarray(p.com)[i] for i in range(3)], v[3:6]
    unit = [[jnp.ones_like(zero) if i == j else zero for j in range(3)] for i in range(3)]
    # velocity of the CoM: v + R (w x c)
    lever = _transposed([matvec(rotation, _cross(e, com)) for e in unit])
    squared = inner_product(com, com)
    about_origin = [
        [(p.inertia[i] + m * squared if i == j else 0.0) - m * com[i] * com[j] for j in range(3)]
        for i in range(3)
    ]
    coupling = [[m * x for x in row] for row in lever]
    mass = [
        *[[m * e for e in unit[i]] + coupling[i] for i in range(3)],
        *[[coupling[j][i] for j in range(3)] + about_origin[i] for i in range(3)],
    ]
    swing = matvec(rotation, _cross(spin, _cross(spin, com)))
    weight = [m * GRAVITY * x for x in rotation[2]]  # of the object in its own axes, upwards
    linear = [-m * swing[0], -m * swing[1], -m * (swing[2] + GRAVITY)]
    gyroscopic = _cross(spin, matvec(about_origin, spin))
    angular = [-a - b for a, b in zip(gyroscopic, _cross(com, weight), strict=True)]
    return ContactProblem(
        mass=mass,
        smooth=[*linear, *angular],
        constraints=[
            _tip_contact(scene, p, q, v, rotation),
            _floor_contacts(scene, p, q, v, rotation),
        ],
        free=(0, 1, 2, 3, 4, 5),
    )
