"""Contact problems of boxes and upright prisms in closed form, without MJX.

The same as MJX's own stages of the same scene (tested to rounding), at a tenth of their operations:
MJX's general tree and collision code is most of what a batch of small scenes costs, above all with
derivatives. In: parameters, positions and velocities. Out: the contact problem over the free
degrees of freedom. Its first constraints are the tip's contacts, its second ones the table's; the
friction of the table enters there.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_inertia.pushing.contact_problem import (
    Constraints,
    ContactLaw,
    ContactProblem,
    contact_rows,
)
from mjx_inertia.pushing.parameters import PushParameters, feet_offsets
from mjx_inertia.pushing.scene import Scene
from mjx_inertia.pushing.settings import (
    FLOOR_SOLIMP,
    FLOOR_SOLREF,
    GRAVITY,
    IMPRATIO,
    TIP_SOLIMP,
    TIP_SOLREF_FRICTION,
)
from mjx_inertia.spatial import AnyArray
from mjx_inertia.spatial.unrolled import (
    IDENTITY,
    Matrix,
    SymmetricMatrix,
    Vector,
    computed_once,
    quaternion_rotation,
)


def planar_problem(scene: Scene, p: PushParameters, q: Vector, v: Vector) -> ContactProblem:
    """An object that slides upright on the table, over x, y, z and yaw.

    `q` is x, y, z, yaw of the object and x, y of the tip (m, rad), `v` their rates.
    """
    cosine, sine = computed_once((jnp.cos(q[3]), jnp.sin(q[3])))
    rotation = Matrix(((cosine, -sine), (sine, cosine)))  # world from object, in the plane
    # CoM from the origin of the object frame, world axes
    x, y = computed_once(rotation @ Vector((p.com[0], p.com[1])))
    # Newton and Euler, about the origin of the object frame
    m, zero = jnp.asarray(p.mass), jnp.zeros_like(q[0])
    centrifugal = m * v[3] * v[3]
    return ContactProblem(
        mass=SymmetricMatrix(
            (
                (m,),
                (zero, m),
                (zero, zero, m),
                (-m * y, m * x, zero, p.inertia[2] + m * (x * x + y * y)),
            )
        ),
        smooth=Vector((centrifugal * x, centrifugal * y, -m * GRAVITY, zero)),
        constraints=[
            _planar_tip_contact(scene, p, q, v, rotation),
            _planar_table_contacts(scene, p, q, v, rotation),
        ],
        free=(0, 1, 2, 3),
    )


def free_problem(scene: Scene, p: PushParameters, q: Vector, v: Vector) -> ContactProblem:
    """A box that stands on its corners (table `corners`) and moves freely.

    `q` is x, y, z and quaternion (wxyz) of the object and x, y of the tip (m), `v` their rates as
    MuJoCo has them: of the object frame's origin in world axes, angular in the object's own axes.
    """
    rotation = computed_once(quaternion_rotation(q[3:7]))  # world from object
    m, com = jnp.asarray(p.mass), Vector(jnp.asarray(p.com)[i] for i in range(3))
    # mass matrix; the CoM moves at v + R (ω × c), so R (e × c) for each axis e of the object
    lever = Matrix(rotation @ axis.cross(com) for axis in IDENTITY)
    squared = com @ com
    about_origin = SymmetricMatrix(
        [
            (p.inertia[i] + m * squared if i == j else 0.0) - m * com[i] * com[j]
            for j in range(i + 1)
        ]
        for i in range(3)
    )
    zero = jnp.zeros_like(q[0])
    mass = [
        *((m,), (zero, m), (zero, zero, m)),
        *((*(m * a), *b) for a, b in zip(lever, about_origin, strict=True)),
    ]
    # Newton and Euler, about the origin of the object frame
    spin = v[3:6]
    linear = -m * (rotation @ spin.cross(spin.cross(com)) + Vector((0.0, 0.0, GRAVITY)))
    weight = m * GRAVITY * rotation[2]  # of the object in its own axes, upwards
    angular = -spin.cross(about_origin @ spin) - com.cross(weight)
    return ContactProblem(
        mass=SymmetricMatrix(mass),
        smooth=Vector((*linear, *angular)),
        constraints=[
            _free_tip_contact(scene, p, q, v, rotation),
            _free_table_contacts(scene, p, q, v, rotation),
        ],
        free=(0, 1, 2, 3, 4, 5),
    )


def integrate_rotation(quaternion: Vector, spin: Vector, step: float) -> Vector:
    """The orientation after a time step (s) at an angular velocity (object axes, rad/s)."""
    squared = spin @ spin
    turns = squared > 0
    rate = jnp.sqrt(jnp.where(turns, squared, 1.0))
    half = 0.5 * step * jnp.where(turns, rate, 0.0)
    # sin(half) / rate, which tends to step / 2
    sine_over_rate = jnp.where(turns, jnp.sin(half) / rate, 0.5 * step)
    # the quaternion times that of the turn
    w, x, y, z = quaternion
    c, (i, j, k) = jnp.cos(half), sine_over_rate * spin
    turned = Vector(
        (
            w * c - x * i - y * j - z * k,
            w * i + x * c + y * k - z * j,
            w * j - x * k + y * c + z * i,
            w * k + x * j - y * i + z * c,
        )
    )
    return jax.lax.rsqrt(turned @ turned) * turned


def _tip_law(scene: Scene, p: PushParameters) -> ContactLaw:
    """Stiffness of the contact between tip and object."""
    solref, timestep = (p.tip_time_constant, 1.0), scene.settings.timestep
    return ContactLaw(solref, TIP_SOLREF_FRICTION, TIP_SOLIMP, IMPRATIO, timestep)


def _table_law(scene: Scene) -> ContactLaw:
    """Stiffness of the contacts between object and table."""
    timestep = scene.settings.timestep
    return ContactLaw(FLOOR_SOLREF, FLOOR_SOLREF, FLOOR_SOLIMP, IMPRATIO, timestep)


def _tip_inverse_mass(scene: Scene, p: PushParameters) -> Array:
    return 1.0 / jnp.asarray(p.mass) + float(scene.model.body_invweight0[scene.tip_body, 0])


def _planar_tip_contact(
    scene: Scene, p: PushParameters, q: Vector, v: Vector, rotation: Matrix
) -> Constraints:
    # the tip's middle seen from the object, and the nearest point of the object
    radius, away = scene.settings.tip_radius, q[4:6] - q[:2]
    distance, normal = _nearest_on_object(scene, p, rotation.T @ away)
    distance = computed_once(distance)
    x, y = normal = computed_once(rotation @ normal)
    # contact: halfway between the two surfaces
    arm_x, arm_y = away + normal * (0.5 * (distance + radius))
    # rows: normal, level tangent, vertical tangent
    jacobian = Matrix(
        (
            (x, y, 0.0, arm_x * y - arm_y * x),
            (-y, x, 0.0, arm_x * x + arm_y * y),
            (0.0, 0.0, 1.0, 0.0),
        )
    )
    tip = Vector((x * v[4] + y * v[5], x * v[5] - y * v[4], 0.0))
    return contact_rows(
        _tip_law(scene, p),
        distance - radius,
        jacobian,
        jacobian @ v[:4] - tip,
        Vector((jnp.asarray(p.tip_friction),) * 2),
        _tip_inverse_mass(scene, p),
    )


def _planar_table_contacts(
    scene: Scene, p: PushParameters, q: Vector, v: Vector, rotation: Matrix
) -> Constraints:
    # rows of each foot: normal, two tangents, and torsion on the limit surface
    feet = feet_offsets(scene, p)
    x, y = rotation @ Vector((feet[:, 0], feet[:, 1]))
    rows = [(0.0, 0.0, 1.0, 0.0), (1.0, 0.0, 0.0, -y), (0.0, 1.0, 0.0, x)]
    friction = [jnp.asarray(p.friction)] * 2
    if scene.settings.table == "limit_surface":
        rows.append((0.0, 0.0, 0.0, 1.0))
        friction.append(jnp.asarray(p.friction * p.friction_radius))
    jacobian, distance = Matrix(rows), jnp.broadcast_to(q[2], x.shape)
    return contact_rows(
        _table_law(scene), distance, jacobian, jacobian @ v[:4], Vector(friction), 1.0 / p.mass
    )


def _nearest_on_object(
    scene: Scene, p: PushParameters, point: Vector
) -> tuple[Float[Array, " c"], Vector]:
    """Distance of the tip's centre from each piece of the object, and the inward normals there."""
    if p.polygons is None and scene.object_model.is_box:
        center = scene.object_model.center
        sides = Vector((p.half_extents[0], p.half_extents[1]))
        distance, normal = nearest_on_box(point - Vector(center[:2].tolist()), sides)
        return distance[None], Vector(n[None] for n in normal)
    polygons = scene.polygons if p.polygons is None else p.polygons
    assert polygons is not None  # a planar scene of an object that is no box
    return nearest_on_polygons(point, polygons)


def _free_tip_contact(
    scene: Scene, p: PushParameters, q: Vector, v: Vector, rotation: Matrix
) -> Constraints:
    center, radius = scene.object_model.center, scene.settings.tip_radius
    height = float(scene.model.body_pos[scene.tip_body, 2])
    # the tip's middle and the nearest point of the box, object axes
    place = rotation.T @ (Vector((*q[7:9], height)) - q[:3])
    middle_of_box = Vector((float(center[0]), float(center[1]), p.half_extents[2]))
    half = Vector(p.half_extents[i] for i in range(3))
    distance, local = computed_once(nearest_on_box(place - middle_of_box, half))
    # contact: halfway between the two surfaces
    lever = computed_once(place + local * (0.5 * (distance + radius)))
    # directions of its rows, world axes: normal, level tangent, the other tangent
    normal = computed_once(rotation @ local)
    level = jax.lax.rsqrt(normal[0] ** 2 + normal[1] ** 2)
    tangent = Vector((-normal[1] * level, normal[0] * level, 0.0))
    directions = Matrix((normal, tangent, normal.cross(tangent)))
    jacobian = _point_jacobian(directions, lever, rotation)
    tip = Vector(d[0] * v[6] + d[1] * v[7] for d in directions)
    return contact_rows(
        _tip_law(scene, p),
        (distance - radius)[None],
        jacobian,
        jacobian @ v[:6] - tip,
        Vector((jnp.asarray(p.tip_friction),) * 2),
        _tip_inverse_mass(scene, p),
    )


def _free_table_contacts(
    scene: Scene, p: PushParameters, q: Vector, v: Vector, rotation: Matrix
) -> Constraints:
    # the four corners of the base, object axes, and their height
    center = scene.object_model.center
    x = center[0] + jnp.array([1.0, -1.0, -1.0, 1.0]) * p.half_extents[0]
    y = center[1] + jnp.array([1.0, 1.0, -1.0, -1.0]) * p.half_extents[1]
    distance = computed_once(q[2] + rotation[2][0] * x + rotation[2][1] * y)
    # contact: halfway between corner and table, straight above or below the corner
    lever = Vector((x, y, 0.0)) - 0.5 * distance * rotation[2]
    directions = Matrix((IDENTITY[2], IDENTITY[0], IDENTITY[1]))
    jacobian = _point_jacobian(directions, lever, rotation)
    friction = Vector((jnp.asarray(p.friction),) * 2)
    return contact_rows(
        _table_law(scene), distance, jacobian, jacobian @ v[:6], friction, 1.0 / p.mass
    )


def _point_jacobian(directions: Matrix, lever: Vector, rotation: Matrix) -> Matrix:
    """Rows of the point at `lever` (object axes) along world directions."""
    return Matrix((*d, *lever.cross(rotation.T @ d)) for d in directions)


def nearest_on_box(point: Vector, half: Vector) -> tuple[Array, Vector]:
    """Distance (m, negative inside) of a point from a box or rectangle, and the inward normal.

    `point` is from the box's centre along its edges, `half` half its edges, m.
    """
    beyond = [jnp.abs(x) - h for x, h in zip(point, half, strict=True)]
    inward = [jnp.where(x < 0, 1.0, -1.0) for x in point]
    deepest = functools.reduce(jnp.maximum, beyond)
    outside = deepest > 0
    # outside: towards the nearest point of the box; inside: through the nearest face
    over = Vector(jnp.maximum(b, 0.0) for b in beyond)
    radius = jnp.sqrt(jnp.where(outside, over @ over, 1.0))
    face = [jnp.where(b == deepest, 1.0, 0.0) for b in beyond]
    normal = Vector(
        side * jnp.where(outside, o / radius, f)
        for side, o, f in zip(inward, over, face, strict=True)
    )
    return jnp.where(outside, radius, deepest), normal


def nearest_on_polygons(
    point: Vector, polygons: Float[AnyArray, "m k 2"]
) -> tuple[Float[Array, " m"], Vector]:
    """Distances (m, negative inside) of a point from convex polygons, and the inward normals there.

    Polygons are counter-clockwise, m; their last vertex may be repeated. The entries of the normals
    are arrays over the polygons.
    """
    xp = np if isinstance(polygons, np.ndarray) else jnp  # what is known is not computed again
    start, edge = polygons, xp.roll(polygons, -1, axis=1) - polygons
    length = xp.hypot(edge[..., 0], edge[..., 1])
    real = length > 0
    along_x, along_y = (edge[..., i] / xp.where(real, length, 1.0) for i in (0, 1))
    # how far the point is beyond each edge, and which edge it is beyond the most
    x, y = point[0] - start[..., 0], point[1] - start[..., 1]
    beyond = jnp.where(real, along_y * x - along_x * y, -jnp.inf)
    deepest = beyond.max(1, keepdims=True)
    facing = jnp.argmax(beyond, 1)[:, None] == np.arange(length.shape[1])
    # the nearest point of each edge, and the nearest edge
    way = jnp.clip(along_x * x + along_y * y, 0.0, length)
    gap_x, gap_y = x - way * along_x, y - way * along_y
    squared = gap_x * gap_x + gap_y * gap_y
    closest = jnp.argmin(squared, 1)[:, None] == np.arange(length.shape[1])

    def at(which: Array, values: Array | np.ndarray) -> Array:
        return jnp.where(which, values, 0.0).sum(1)

    # outside: towards the nearest point; inside: through the nearest edge
    outside = deepest[:, 0] > 0
    radius = jnp.sqrt(jnp.where(outside, at(closest, squared), 1.0))
    normal_x = jnp.where(outside, -at(closest, gap_x) / radius, -at(facing, along_y))
    normal_y = jnp.where(outside, -at(closest, gap_y) / radius, at(facing, along_x))
    return jnp.where(outside, radius, deepest[:, 0]), Vector((normal_x, normal_y))
