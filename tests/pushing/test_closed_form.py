"""The closed form of boxes and prisms against MJX's own pipeline, state by state."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
import shapely
from cube_pushes import cubes

from mjx_inertia.objects import prism
from mjx_inertia.pushing import (
    SceneSettings,
    build_scene,
    object_parameters,
    recompile,
    resting_height,
)
from mjx_inertia.pushing.closed_form import (
    integrate_rotation,
    nearest_on_box,
    nearest_on_polygons,
)
from mjx_inertia.pushing.parameters import with_parameters
from mjx_inertia.pushing.quiet_mjx import mjx
from mjx_inertia.pushing.rollout import State, _closed_form_forward, _integrate, _mjx_forward
from mjx_inertia.spatial.unrolled import Vector


def states(scene, parameters, rng, count):
    """Boxes that turn and sink, tips that press a face, an edge, or nothing."""
    planar, half = scene.planar, np.asarray(parameters.half_extents)
    pose = np.c_[rng.normal(0, 0.05, (count, 2)), rng.uniform(-3, 3, count)]
    depth = resting_height(scene) * rng.uniform(-0.5, 2.0, count)
    side = np.c_[
        -half[:, 0] - rng.uniform(0.0046, 0.0052, count), rng.uniform(-1, 1, count) * half[:, 1]
    ]
    edge = -half[:, :2] - 0.0049 / np.sqrt(2)
    at = np.where((np.arange(count) % 4 == 0)[:, None], edge, side)
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    tip = pose[:, :2] + np.c_[c * at[:, 0] - s * at[:, 1], s * at[:, 0] + c * at[:, 1]]
    if planar:
        body = np.c_[pose[:, :2], depth, pose[:, 2]]
    else:
        tilt = rng.normal(0, 3e-4, (count, 2))
        turn = np.c_[np.cos(pose[:, 2] / 2), tilt, np.sin(pose[:, 2] / 2)]
        body = np.c_[pose[:, :2], depth, turn / np.linalg.norm(turn, axis=1, keepdims=True)]
    nv = scene.model.nv
    return State(
        qpos=Vector(np.c_[body, tip].T),
        qvel=Vector(rng.normal(0, 0.05, (nv, count))),
        qacc=Vector(np.zeros((nv, count))),
    )


def boxes(count):
    """Boxes of three edge lengths with three moments of inertia and the CoM off the centre."""
    parameters = cubes(count, seed=8, com_offset=0.2)
    return parameters.replace(
        inertia=parameters.inertia * np.array([1.2, 0.8, 1.1]),
        half_extents=parameters.half_extents * np.array([1.0, 0.7, 1.3]),
    )


def mujoco_accelerations(scene, parameters, state):
    """By C MuJoCo, of the object."""
    rows = []
    for i in range(len(parameters.mass)):
        one = jax.tree.map(lambda x, i=i: np.asarray(x)[i], parameters)
        model = recompile(scene, one)
        data = mujoco.MjData(model)
        data.qpos[:] = [q[i] for q in state.qpos]
        data.qvel[:] = [v[i] for v in state.qvel]
        mujoco.mj_forward(model, data)
        rows.append(data.qacc[:-2].copy())
    return np.array(rows)


@pytest.mark.parametrize("table", ["limit_surface", "corners"])
@pytest.mark.long
@pytest.mark.float64
def test_accelerations_and_forces_at_random_states(scene_of, table):
    """Faces, sticking, sliding, off the tip, in the air: those of MJX to 1e-8.

    At edges, where MJX moves the nearest point by 1e-6 of the edge, those of C MuJoCo to 1e-5.
    """
    scene, parameters, n = scene_of(table), boxes(80), scene_of(table).model.nv
    state = states(scene, parameters, np.random.default_rng(8), 80)
    ours = jax.jit(jax.vmap(lambda p, s: _closed_form_forward(scene, p, s)))(parameters, state)
    theirs = jax.jit(jax.vmap(lambda p, s: _mjx_forward(scene, with_parameters(scene, p), s)))(
        parameters, state
    )
    edge = np.arange(80) % 4 == 0
    touched = np.abs(np.stack(theirs[1])).max(0) > 0
    assert 0.3 < touched[~edge].mean() < 0.9
    assert touched[edge].mean() > 0.3
    for mine, reference in zip(ours, theirs, strict=True):
        expected = np.stack(reference)[:, ~edge]
        scale = np.maximum(np.abs(expected).max(0), 1e-6)
        np.testing.assert_allclose(np.stack(mine)[:, ~edge] / scale, expected / scale, atol=1e-8)
    of = np.flatnonzero(edge)
    expected = mujoco_accelerations(
        scene, *jax.tree.map(lambda x: np.asarray(x)[of], (parameters, state))
    )
    found = np.stack(ours[0][: n - 2], 1)[of]
    scale = np.abs(expected).max(1, keepdims=True)
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-5)


OUTLINES = {
    "hexagon": 0.06 * np.array([[np.cos(a), np.sin(a)] for a in np.pi / 3 * np.arange(6)]),
    "L": np.array([[0, 0], [0.12, 0], [0.12, 0.04], [0.04, 0.04], [0.04, 0.1], [0, 0.1]]),
}


@pytest.mark.parametrize(("table", "name"), [("limit_surface", "L"), ("pads", "hexagon")])
@pytest.mark.long
@pytest.mark.float64
def test_prisms_move_as_in_mjx(table, name):
    """Tips at random places along the outline, away from corners: accelerations to 1e-4.

    MuJoCo keeps the vertices of meshes in single precision.
    """
    obj = prism(OUTLINES[name], 0.05, 1.0, name=name)
    scene = build_scene(obj, SceneSettings(table=table))
    assert scene.has_closed_form
    rng, n = np.random.default_rng(6), 60
    outline = obj.outline
    edge = rng.integers(len(outline), size=n)
    share = rng.uniform(0.2, 0.8, n)[:, None]
    ahead = np.roll(outline, -1, axis=0)[edge]
    along = ahead - outline[edge]
    outward = np.c_[along[:, 1], -along[:, 0]] / np.linalg.norm(along, axis=1, keepdims=True)
    tip = outline[edge] + share * along + rng.uniform(0.0046, 0.0052, (n, 1)) * outward
    depth = resting_height(scene) * rng.uniform(-0.5, 2.0, n)
    # the object frame is the world's: turning is tested with boxes
    qpos = np.c_[np.zeros((n, 2)), depth, np.zeros(n), tip]
    nv = scene.model.nv
    state = State(Vector(qpos.T), Vector(rng.normal(0, 0.05, (nv, n))), Vector(np.zeros((nv, n))))
    parameters = jax.tree.map(
        lambda x: np.broadcast_to(x, (n, *np.shape(x))), object_parameters(obj, friction=0.4)
    )
    ours = jax.jit(jax.vmap(lambda p, s: _closed_form_forward(scene, p, s)))(parameters, state)
    theirs = jax.jit(jax.vmap(lambda p, s: _mjx_forward(scene, with_parameters(scene, p), s)))(
        parameters, state
    )
    for mine, reference in zip(ours, theirs, strict=True):
        expected = np.stack(reference)
        scale = np.maximum(np.abs(expected).max(0), 1e-6)
        np.testing.assert_allclose(np.stack(mine) / scale, expected / scale, atol=1e-4)


def test_nearest_point_of_polygons_equals_that_of_shapely():
    """Signed distance of a triangle and a pentagon, padded to one length, inside and out."""
    triangle = np.array([[0, 0], [1, 0], [0, 1], [0, 1], [0, 1]], float)
    pentagon = np.array([[np.cos(a), np.sin(a)] for a in 0.3 + 2 * np.pi / 5 * np.arange(5)])
    points = np.random.default_rng(1).uniform(-2, 2, (200, 2))
    stacked = np.stack([triangle, pentagon])
    distance, normal = jax.vmap(lambda p: nearest_on_polygons(Vector(p), stacked))(points)
    for j, polygon in enumerate((shapely.Polygon(triangle), shapely.Polygon(pentagon))):
        for i, point in enumerate(shapely.points(points)):
            inside = polygon.contains(point)
            expected = polygon.exterior.distance(point) * (-1 if inside else 1)
            np.testing.assert_allclose(distance[i, j], expected, atol=1e-6)
            foot = points[i] + np.array([normal[0][i, j], normal[1][i, j]]) * float(distance[i, j])
            assert polygon.exterior.distance(shapely.Point(foot)) < 1e-6


@pytest.mark.parametrize("table", ["limit_surface", "corners"])
@pytest.mark.float64
def test_integration_equals_that_of_mjx(scene_of, table):
    scene = scene_of(table)
    parameters = cubes(8, seed=3)
    state = states(scene, parameters, np.random.default_rng(3), 8)
    qacc = Vector(np.random.default_rng(4).normal(size=(len(state.qvel), 8)))

    def theirs(p, s, a):
        stacked = {"qpos": jnp.stack(s.qpos), "qvel": jnp.stack(s.qvel), "qacc": jnp.stack(a)}
        data = scene.data.replace(**stacked, act_dot=jnp.zeros(0))
        data = mjx.euler(with_parameters(scene, p), data)
        return data.qpos, data.qvel

    qpos, qvel = jax.vmap(theirs)(parameters, state, qacc)
    ours = jax.vmap(lambda s, a: _integrate(scene, s, a))(state, qacc)
    np.testing.assert_allclose(np.stack(ours.qpos, 1), qpos, rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.stack(ours.qvel, 1), qvel, rtol=0, atol=1e-14)


@pytest.mark.float64
def test_rotation_has_derivatives_at_rest():
    """An object at rest turns by nothing, and the derivative is that of a small turn."""
    rest = Vector(jnp.array([1.0, 0.0, 0.0, 0.0]))
    slope = jax.jacfwd(lambda w: jnp.stack(integrate_rotation(rest, Vector(w), 0.01)))(jnp.zeros(3))
    np.testing.assert_allclose(slope, 0.005 * np.eye(4)[:, 1:], atol=1e-15)


def test_nearest_side_of_a_box_inside_and_out():
    """Over a face, off an edge, off a corner, inside."""
    half = Vector(jnp.array([1.0, 2.0, 3.0]))
    cases = {
        (1.5, 0.3, -1.0): (0.5, (-1, 0, 0)),
        (-4.0, 6.0, 0.0): (5.0, (0.6, -0.8, 0)),
        (2.0, 3.0, -4.0): (3**0.5, (-(3**-0.5), -(3**-0.5), 3**-0.5)),
        (0.9, 0.0, 0.0): (-0.1, (-1, 0, 0)),
    }
    for point, (distance, normal) in cases.items():
        found, direction = nearest_on_box(Vector(jnp.array(point)), half)
        np.testing.assert_allclose(found, distance, rtol=1e-6)
        np.testing.assert_allclose(direction, normal, atol=1e-6)
