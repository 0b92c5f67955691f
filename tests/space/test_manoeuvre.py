"""What a decision does to base and hands, against the closed form and integration in NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import planned
import pytest

from mjx_inertia.space import CourseStatus, course
from mjx_inertia.space.manoeuvre import RESOLVED

pytestmark = pytest.mark.long
KINDS = {"consistent": planned.consistent, "printed": planned.printed}


def decisions(kind, scale=10.0, count=planned.BATCH, seed=1):
    return np.random.default_rng(seed).uniform(-scale, scale, (count, KINDS[kind]().size))


@pytest.fixture(scope="module", params=KINDS)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def found(kind):
    """Courses of many decisions, one of them not a number."""
    rows = decisions(kind)
    rows[0], rows[5] = 0.0, np.nan
    with jax.enable_x64(True):
        return planned.evaluated(KINDS[kind])(rows)[0]


@pytest.fixture(scope="module")
def mild(kind):
    """Four decisions that succeed: their courses, and their motions at 100 Hz."""
    rows = decisions(kind, 0.5, planned.SAMPLED, 2)
    rows[0] = 0.0
    with jax.enable_x64(True):
        courses = planned.evaluated(KINDS[kind])(rows)[0]
        motion, _ = planned.sampled(KINDS[kind])(rows)
    assert np.all(courses.status == CourseStatus.OK)
    return courses, motion


def matrices(kind, q, theta):
    return planned.planar_matrices(q, theta, with_object=kind == "consistent")


def test_base_and_arms_have_no_momentum(kind, found):
    """Eq. 7.3 by the closed form's matrices, at every node."""
    motion = found.motion
    whole = np.isfinite(found.base_turn[:, 2])
    assert whole.sum() == planned.BATCH - 1
    q, qd = motion.q[whole], motion.qd[whole]
    H = matrices(kind, q, np.zeros(q.shape[:2])).H
    by_joints = np.einsum("btij,btj->bti", H[..., :3, 3:], qd)
    total = by_joints + np.einsum("btij,btj->bti", H[..., :3, :3], found.nodes.base_twist[whole])
    assert np.max(np.abs(total) / np.max(np.abs(by_joints), (1, 2), keepdims=True)) < 1e-10


def test_final_base_is_the_integral_of_equation_7_18(kind, mild):
    """ẋ_b = J_a q̇ in inertial axes, as printed, by Runge and Kutta's method in NumPy."""
    courses, motion = mild
    q, qd = motion.q[:, ::5], motion.qd[:, ::5]
    step = 2.0 * KINDS[kind]().duration / (q.shape[1] - 1)

    def rate(place, i):
        H = matrices(kind, q[:, i], place[:, 2]).H
        push = np.einsum("nij,nj->ni", H[:, :3, 3:], qd[:, i])
        return -np.linalg.solve(H[:, :3, :3], push[..., None])[..., 0]

    base = np.zeros((len(q), 3))
    for i in range(0, q.shape[1] - 2, 2):
        k1 = rate(base, i)
        k2 = rate(base + step / 2.0 * k1, i + 1)
        k3 = rate(base + step / 2.0 * k2, i + 1)
        k4 = rate(base + step * k3, i + 2)
        base = base + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    np.testing.assert_allclose(courses.base_turn[:, 2], base[:, 2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(courses.base_place[:, :2], base[:, :2], rtol=0, atol=1e-9)
    assert np.all(courses.base_turn[:, :2] == 0.0) and np.max(np.abs(courses.base_place[:, 2])) == 0


def center_of_mass(kind, q):
    """Against the base's origin at attitude zero: from the entries of H that couple x, y and θ."""
    H = matrices(kind, q, np.zeros(q.shape[:-1])).H
    return np.stack([H[..., 1, 2], -H[..., 0, 2]], -1) / H[..., :1, 0]


def rotated(angle, vector):
    c, s = np.cos(angle), np.sin(angle)
    x, y = vector[..., 0], vector[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], -1)


def held(found):
    return np.isfinite(found.base_turn[:, 2]) & (
        (found.status == CourseStatus.OK) | (found.status == CourseStatus.UNRESOLVED)
    )


def test_base_translation_is_no_matter_of_the_path(kind, found):
    """It follows from the final attitude alone, since the centre of mass stays (errata 30)."""
    m = KINDS[kind]()
    start, end = (center_of_mass(kind, np.asarray(q)) for q in (m.q_start, m.q_end))
    rows = held(found)
    turn = found.base_turn[rows, 2]
    wanted = start - rotated(turn, np.tile(end, (len(turn), 1)))
    np.testing.assert_allclose(found.base_place[rows, :2], wanted, rtol=0, atol=1e-9)


def test_error_of_the_hands_is_that_of_the_attitude(kind, found):
    """The system turns about its centre of mass: without a turn of the base the hands are right."""
    m = KINDS[kind]()
    rows = held(found)
    turn = found.base_turn[rows, 2]
    assert len(turn) > 5 and np.ptp(turn) > 0.01
    terms = planned.planar_matrices(np.asarray(m.q_end), np.zeros(()), with_object=False)
    from_com = terms.hands[:, :2] - center_of_mass(kind, np.asarray(m.q_end))
    wanted = rotated(turn[:, None], from_com[None]) - from_com
    np.testing.assert_allclose(found.hand_error[rows][..., :2], wanted, rtol=0, atol=1e-9)
    angle = np.stack([planned.wrapped(turn)] * 2, 1)
    np.testing.assert_allclose(found.hand_turn[rows][..., 2], angle, rtol=0, atol=1e-9)


def test_status_says_what_is_the_matter(kind, found):
    """Each with the figures that deserve it; the closure by the closed form."""
    m = KINDS[kind]()
    both = planned.held_by_hands(matrices(kind, found.motion.q, np.zeros(found.motion.q.shape[:2])))
    apart = np.linalg.norm(both[:, :, 1, :2] - both[:, :, 0, :2], axis=-1).max(1)
    angle = np.abs(planned.wrapped(both[:, :, 1, 2] - both[:, :, 0, 2])).max(1)
    whole = np.arange(len(apart)) != 5
    np.testing.assert_allclose(found.closure[whole, 0], apart[whole], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.closure[whole, 1], angle[whole], rtol=1e-9, atol=1e-9)

    assert list(np.flatnonzero(found.status == CourseStatus.NOT_FINITE)) == [5]
    assert found.status[0] == CourseStatus.OK
    fine = found.unresolved <= RESOLVED
    if kind == "printed":
        assert m.closure_limit is None and np.max(apart[whole]) > 0.1
        assert np.all(found.limit_excess[whole] == 0.0)
        wanted = np.where(fine, CourseStatus.OK, CourseStatus.UNRESOLVED)
    else:
        beyond = np.maximum(found.motion.q - m.robot.upper, m.robot.lower - found.motion.q)
        out = beyond.max((1, 2)) > 1e-9
        lost = np.maximum(apart, angle) > m.closure_limit
        rest = np.where(fine, CourseStatus.OK, CourseStatus.UNRESOLVED)
        wanted = np.where(
            lost, CourseStatus.NOT_HELD, np.where(out, CourseStatus.JOINT_LIMIT, rest)
        )
        assert set(found.status) == set(CourseStatus)
    np.testing.assert_array_equal(found.status[whole], wanted[whole])


def test_a_failure_leaves_the_rest_of_the_batch_alone(kind, found):
    good = np.flatnonzero(found.status == CourseStatus.OK)
    rows = np.where(np.isin(np.arange(planned.BATCH), good)[:, None], decisions(kind), 0.0)
    rows[0] = 0.0
    alone = planned.evaluated(KINDS[kind])(rows)[0]
    for ours, theirs in zip(jax.tree.leaves(alone), jax.tree.leaves(found), strict=True):
        np.testing.assert_array_equal(ours[good], theirs[good])


def test_a_decision_of_the_wrong_size(kind):
    m = KINDS[kind]()
    with pytest.raises(ValueError, match=rf"`coefficients` has shape \(5,\).*\({m.size},\)"):
        course(m, jnp.zeros(5))


def test_ends_in_which_the_arms_do_not_hold_the_object():
    """`closed_chain_motion` would close the chain; the ends as they are given count."""
    m = planned.consistent()
    apart = np.array([0.0, 0.0, 0.0, 0.1, -0.15, 0.1])
    high = np.array(m.q_start)
    high[3] = 3.2
    changed = {
        "q_start": m.q_start + apart,
        "q_end": m.q_end + apart,
        "beyond": high,
    }

    def status(q_start, q_end):
        found = course(m.replace(q_start=q_start, q_end=q_end), jnp.zeros(m.size), total=False)
        return found.status, found.closure, found.limit_excess

    run = jax.jit(status)
    assert run(m.q_start, m.q_end)[0] == CourseStatus.OK
    for ends in ((changed["q_start"], m.q_end), (m.q_start, changed["q_end"])):
        found, closure, _ = run(*ends)
        assert found == CourseStatus.NOT_HELD and closure[0] > 0.05
    assert run(changed["beyond"], m.q_end)[2] > 0.19


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"duration": -5.0}, r"`duration` is -5\.0 s"),
        ({"leading": ()}, "`leading` is empty"),
        ({"capture": "weightless"}, r"`capture` has a mass of 0\.0 kg"),
    ],
)
def test_manoeuvres_that_were_not_planned(change, words):
    m = planned.consistent()
    if "capture" in change:
        inertial = m.capture.inertial.replace(mass=np.zeros(()))
        change = {"capture": m.capture.replace(inertial=inertial)}
    with pytest.raises(ValueError, match=words):
        course(m.replace(**change), jnp.zeros(m.size))
