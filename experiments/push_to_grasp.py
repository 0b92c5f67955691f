"""From a push to a grasp: what an estimate is worth when a grasp is chosen by it.

    python experiments/push_to_grasp.py [object=clay_brick] [grasps=500] [pushes=2] [seed=0]

A catalogue object is pushed from drawn sides with drawn friction (limit surface, 0.6 s, sensor
noise), `sysid` estimates mass, I_zz and CoM with their covariance, and the shape filled with one
density completes them to ten parameters. Baxter's left arm then grasps it for a pick and place: the
grasp of least effort, and the one of least gripping force, by the estimate, by its 95 % quantile
and by the worst of its ellipsoid, against the best under the truth; and how the regret grows with
the error of an estimate. Figure: regret.
"""

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Array, Float
from scipy import stats

from mjx_inertia import runtime
from mjx_inertia.dataset import SensorNoise, add_noise
from mjx_inertia.estimators import EstimateStatus
from mjx_inertia.estimators.sysid import SysidSettings, sysid
from mjx_inertia.experiment import experiment
from mjx_inertia.features import Examples
from mjx_inertia.grasping import (
    PARALLEL_JAW_80MM,
    TASKS,
    GraspCosts,
    GraspStatus,
    PayloadBelief,
    SamplerSettings,
    SoftFinger,
    belief_of_push,
    evaluate_grasps,
    greatest_gripping_force,
    hands_of,
    linear_cost,
    object_path,
    regret,
    sample_grasps,
    sampled_cost,
)
from mjx_inertia.objects import (
    ObjectModel,
    ShapeEstimate,
    TriangleMesh,
    friction_radius,
    load_catalogue,
    mass_properties,
)
from mjx_inertia.pushing import (
    PushSetup,
    StraightMotion,
    build_scene,
    first_contact,
    object_parameters,
    plan_polygons,
    simulate,
)
from mjx_inertia.robots import Robot, baxter, inverse_dynamics, over_states, with_payload
from mjx_inertia.spatial import (
    InertialParameters,
    PlanarInertia,
    Pose,
    from_ten_vector,
    to_log_cholesky,
    to_ten_vector,
)

TASK = "pick_and_place_1"
PLACE = (0.6, 0.3, -0.15)  # of the object, in the robot's frame
WIDE = dataclasses.replace(
    PARALLEL_JAW_80MM, name="wide jaw", open_width=0.12, force_limit=140.0
)  # no product
PAD = SoftFinger(friction=0.5)
SPEED, SECONDS = 0.06, 0.6  # of a push
SHAPE_STD = 0.01  # of the shape's log-Cholesky parameters: a scan of a simple body
ERRORS = (1, 2, 5, 10, 20, 50)  # percent
DRAWS = 300
Cost = Callable[[InertialParameters], Float[Array, " n"]]


@dataclasses.dataclass(frozen=True)
class Options:
    """Command-line options."""

    object: str = "clay_brick"  # of the catalogue
    grasps: int = 500  # sampled
    pushes: int = 2
    seed: int = 0  # of pushes, noise, grasps and errors


def push(obj: ObjectModel, count: int, seed: int) -> tuple[PlanarInertia, np.ndarray, list[str]]:
    """Pushes, identifies, and joins the answers by their information; object frame."""
    rng = np.random.default_rng(seed)
    settings = SysidSettings(block=count, draws=1, coarse=0.3, start_features=None, progress=False)
    middle, point, normal, direction = (np.array(x) for x in sides(obj, count, settings, rng))
    motion = StraightMotion(
        start=middle - 1e-5 * direction,
        direction=direction,
        speed=np.full(count, SPEED),
        ramp=np.zeros(count),
        duration=np.full(count, SECONDS),
    )
    radius = float(friction_radius(obj.support, obj.center[:2]))
    friction, tip, stiffness = rng.uniform([0.25, 0.2, 0.01], [0.5, 0.5, 0.04], (count, 3)).T
    each = [object_parameters(obj, friction[i], tip[i], stiffness[i], radius) for i in range(count)]
    parameters = jax.tree.map(lambda *leaves: np.stack(leaves), *each)
    record = simulate(
        build_scene(obj, settings.scene), parameters, motion,
        contact_point=point, contact_normal=normal,
    )  # fmt: skip
    noisy = add_noise(
        record, np.arange(count, dtype=np.uint32), SensorNoise(floor=1.0), key=jax.random.key(seed)
    )
    setup = PushSetup(
        motion=motion,
        pose=np.zeros((count, 3)),
        half_extents=np.tile(obj.half_extents, (count, 1)),
        friction_radius=np.full(count, radius),
        shape=np.zeros(count, np.int32),
    )
    examples = Examples(
        jnp.zeros((count, 0)),
        jnp.asarray(record.status),
        None,
        (),
        records=noisy,
        setup=setup,
        shapes=(obj,),
    )  # fmt: skip
    estimator = sysid(settings)
    answer = estimator.predict(estimator.fit(examples, key=jax.random.key(0)), examples)
    status = np.asarray(answer.status)
    fine = np.flatnonzero(status == EstimateStatus.OK)
    if not len(fine):
        raise ValueError(f"no push was identified: {[EstimateStatus(s).name for s in status]}")
    # the CoM of an estimate counts from the point of first contact, x along the inward normal
    left = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    turn = np.tile(np.eye(4), (count, 1, 1))
    turn[:, 2:, 2], turn[:, 2:, 3] = normal, left
    values = np.einsum("nij,nj->ni", turn, np.asarray(answer.mean))
    values[:, 2:] += point
    spread = turn @ np.asarray(answer.covariance) @ turn.swapaxes(1, 2)
    information = np.linalg.inv(spread[fine])
    covariance = np.linalg.inv(information.sum(axis=0))
    mean = covariance @ np.einsum("nij,nj->i", information, values[fine])
    names = [EstimateStatus(s).name for s in status]
    return PlanarInertia(*map(jnp.asarray, (mean[0], mean[1], mean[2:]))), covariance, names


def sides(
    obj: ObjectModel, count: int, settings: SysidSettings, rng: np.random.Generator
) -> list[list[np.ndarray]]:
    """Middle of the tip, contact point, normal and direction of drawn pushes, off the middle."""
    radius = settings.scene.tip_radius
    polygons = plan_polygons(obj, min(settings.scene.tip_height, obj.height / 2), radius)
    drawn: list[tuple[np.ndarray, ...]] = []
    while len(drawn) < count:
        angle, offset = rng.uniform(-np.pi, np.pi), rng.uniform(0.2, 0.6) * rng.choice([-1, 1])
        direction = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-direction[1], direction[0]])
        extent = polygons.reshape(-1, 2) @ across
        line = across * (0.5 * (extent.min() + extent.max()) + offset * 0.5 * np.ptp(extent))
        found = first_contact(polygons, line, direction, radius)
        if found is not None and found[2] @ direction > np.cos(np.radians(35.0)):
            drawn.append((*found, direction))
    return [list(column) for column in zip(*drawn, strict=True)]


def shape_of(obj: ObjectModel) -> ShapeEstimate:
    """The shape as a good scan would tell it: that of the mesh, 1 % uncertain."""
    vertices, faces = np.asarray(obj.mesh.vertices), np.asarray(obj.mesh.faces)
    body = mass_properties(vertices, faces, 1.0)
    reference = np.asarray(body.com)
    theta = np.asarray(to_log_cholesky(body.replace(com=jnp.zeros(3))))
    radius = float(np.exp(np.mean(theta[1:4])))
    std = SHAPE_STD * np.array([1.0, 1.0, 1.0, 1.0, *([radius] * 6)])
    return ShapeEstimate(theta, np.diag(std**2), reference, 1.0, TriangleMesh(vertices, faces))


def effort_of(arm: Robot, hands: Pose, found: GraspCosts) -> tuple[Cost, Callable[..., Array]]:
    """Effort and torque of every grasp as functions of the payload, its motion being planned.

    Torque is affine in the ten parameters (Atkeson, An and Hollerbach 1986), so its square summed
    over the waypoints is a quadratic form: thousands of payloads cost a few products.
    """
    middle = InertialParameters(jnp.asarray(1.0), jnp.zeros(3), 1e-2 * jnp.eye(3))
    start = to_ten_vector(middle)

    def one(hand: Pose, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        def torque(ten: Array) -> Array:
            holding = with_payload(arm, from_ten_vector(ten), hand.inverse())
            return jax.vmap(lambda *state: inverse_dynamics(holding, *state))(q, qd, qdd)

        slope = jax.jacfwd(torque)(start)
        return torque(start) - slope @ start, slope

    m = found.motion
    bare, slope = jax.jit(over_states(one, 64))(hands, m.q, m.qd, m.qdd)
    square = jnp.einsum("nkji,nkjl->nil", slope, slope)
    cross, alone = jnp.einsum("nkji,nkj->ni", slope, bare), jnp.sum(bare**2, axis=(1, 2))

    def effort(payload: InertialParameters) -> Array:
        ten = to_ten_vector(payload)
        return jnp.sqrt(alone + 2.0 * cross @ ten + jnp.einsum("nij,i,j->n", square, ten, ten))

    def torque(payload: InertialParameters) -> Array:
        return bare + slope @ to_ten_vector(payload)

    return jax.jit(effort), torque


def wrong(truth: InertialParameters, size: np.ndarray, error: float, key: Array) -> Any:
    """Payloads whose mass errs by `error` and whose CoM by as much of the half extents (1 sigma).

    The tensor goes with the mass.
    """
    first, second = jax.random.split(key)
    factor = jnp.exp(error * jax.random.normal(first, (DRAWS,)))
    shift = error * size * jax.random.normal(second, (DRAWS, 3))
    inertia = factor[:, None, None] * truth.inertia
    return InertialParameters(factor * truth.mass, truth.com + shift, inertia)


def judged(
    cost: Cost,
    belief: PayloadBelief,
    truth: InertialParameters,
    size: np.ndarray,
    valid: np.ndarray,
    key: Array,
) -> dict[str, Any]:
    """Regret of the choices, and by the error of an estimate."""
    mask = jnp.where(jnp.asarray(valid), 0.0, jnp.inf)
    true = cost(truth) + mask
    linear = linear_cost(cost, belief)
    sampled = sampled_cost(cost, belief, key=key, count=DRAWS)
    rules = {
        "center": linear.mean, "quantile": linear.quantile, "worst": linear.worst,
        "sampled_mean": sampled.mean, "sampled_quantile": sampled.quantile,
    }  # fmt: skip
    chosen = regret(jnp.stack(list(rules.values())) + mask, true)
    result: dict[str, Any] = {
        "regret_percent": percent(dict(zip(rules, chosen.relative, strict=True))),
        "chosen": dict(zip(rules, np.asarray(chosen.chosen).tolist(), strict=True)),
        "best": int(jnp.argmin(true)),
        "spread_percent": percent({"": jnp.max(jnp.where(valid, true, 0)) / jnp.min(true) - 1})[""],
        "std_linear_over_sampled": round(float(jnp.median(linear.std / sampled.std)), 3),
        "std_percent": round(100 * float(jnp.median(linear.std / linear.mean)), 3),
    }
    mean, tail, within = {}, {}, {}
    for error in ERRORS:
        payloads = wrong(truth, size, error / 100, jax.random.fold_in(key, error))
        lost = regret(jax.lax.map(cost, payloads) + mask, true).relative
        name = str(error)
        mean[name], tail[name] = jnp.mean(lost), jnp.quantile(lost, 0.95)
        within[name] = jnp.mean(lost <= 0.05)
    enough = [error for error in ERRORS if float(within[str(error)]) >= 0.95]
    return {
        **result,
        "regret_mean_percent_by_error": percent(mean),
        "regret_p95_percent_by_error": percent(tail),
        "within_5_percent_share_by_error": {k: round(float(v), 3) for k, v in within.items()},
        "largest_error_percent_within_5": max(enough, default=None),
    }


def percent(values: dict[str, Any]) -> dict[str, float]:
    """Shares as percentages."""
    return {name: round(100 * float(value), 3) for name, value in values.items()}


def payload_part(effort: Cost, truth: InertialParameters, valid: np.ndarray) -> dict[str, float]:
    """How much of the effort, and of its differences between grasps, the payload decides."""
    nothing = jax.tree.map(lambda x: 1e-9 * x, truth).replace(com=truth.com)
    held, alone = (np.asarray(effort(body))[valid] for body in (truth, nothing))
    return {
        "arm_alone_over_effort": round(float(np.mean(alone / held)), 3),
        "spearman_arm_alone": round(float(stats.spearmanr(alone, held).statistic), 3),
        "std_of_payload_part_over_std": round(float(np.std(held - alone) / np.std(held)), 3),
        "regret_without_payload_percent": round(
            100 * float(held[np.argmin(alone)] / held.min() - 1), 3
        ),
    }


def draw(results: dict[str, dict[str, Any]], path: Path) -> None:
    """Regret over the error of an estimate."""
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    for (name, result), color in zip(results.items(), ("tab:blue", "tab:orange"), strict=True):
        for key, style in (("mean", "o-"), ("p95", "s--")):
            values = result[f"regret_{key}_percent_by_error"].values()
            axis.plot(ERRORS, list(values), style, color=color, label=f"{name}, {key}")
    axis.axhline(5.0, color="0.6", lw=1.0)
    axis.set(xscale="log", xlabel="error of mass, and of CoM over half extents, %")
    axis.set(ylabel="regret, % of the best")
    axis.legend()
    figure.savefig(path)
    plt.close(figure)


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Prints the estimate and the choices, and draws the figure."""
    begin = time.perf_counter()
    runtime.configure(float64=True)
    obj = load_catalogue([options.object])[options.object]
    truth = jax.tree.map(lambda x: jnp.asarray(x, float), obj.inertial)
    pushed, covariance, statuses = push(obj, options.pushes, options.seed)
    belief = belief_of_push(pushed, covariance, shape_of(obj))
    estimate = belief.center
    off = {
        "mass_percent": round(100 * float(estimate.mass / truth.mass - 1), 2),
        "com_mm": np.round(1e3 * np.asarray(estimate.com - truth.com), 2).tolist(),
        "mass_std_percent": round(100 * float(np.sqrt(covariance[0, 0]) / pushed.mass), 2),
        "com_std_mm": np.round(1e3 * np.sqrt(np.diag(covariance)[2:]), 2).tolist(),
    }
    print(f"{obj.name}, {float(truth.mass):.3f} kg, pushes {statuses}: estimate off by {off}")
    arm = baxter("left")
    sample = sample_grasps(
        obj, WIDE, options.grasps, seed=options.seed, settings=SamplerSettings(above_table=True)
    )
    hands = hands_of(sample.grasps, WIDE)
    path = object_path(TASKS[TASK], Pose(np.eye(3), np.array(PLACE)), estimate.com)
    found = evaluate_grasps(arm, estimate, hands, path)
    status = np.asarray(found.status)
    counts = {s.name: int(np.sum(status == s)) for s in GraspStatus if np.any(status == s)}
    rows = np.flatnonzero(status == GraspStatus.OK)
    if not len(rows):
        raise ValueError(f"no grasp of {obj.name} can be carried out: {counts}")
    hands, found, contacts = jax.tree.map(
        lambda x: jnp.asarray(x)[rows], (hands, found, sample.grasps.contacts)
    )
    effort, torque = effort_of(arm, hands, found)
    metric = np.asarray(found.costs)[:, found.names.index("effort")]
    agrees = float(np.max(np.abs(np.asarray(effort(estimate)) / metric - 1)))
    within = jnp.all(jnp.abs(torque(truth)) <= jnp.asarray(arm.torque_limit), axis=(1, 2))

    def squeeze(payload: InertialParameters) -> Float[Array, " n"]:
        return greatest_gripping_force(contacts, PAD, payload, coarse, arm.gravity)

    coarse = object_path(TASKS[TASK], Pose(np.eye(3), np.array(PLACE)), estimate.com, 15)
    size, key = np.asarray(obj.half_extents), jax.random.key(options.seed)
    everywhere = (belief, truth, size, np.asarray(within), key)
    results = {
        "effort": judged(effort, *everywhere),
        "gripping_force": judged(squeeze, *everywhere),
    }
    for name, result in results.items():
        print(f"{name}: regret, %, by rule {result['regret_percent']}")
        print(f"  mean by error of the estimate, % {result['regret_mean_percent_by_error']}")
    draw(results, folder / "regret.svg")
    return {
        "experiment": "push_to_grasp",
        "object": obj.name,
        "estimate": off,
        "statuses": counts,
        "over_torque_limit_under_truth": int(np.sum(~np.asarray(within))),
        "quadratic_form_relative_difference": agrees,
        "regret_percent": results["effort"]["regret_percent"]["center"],
        "regret_mean_percent_by_error": results["effort"]["regret_mean_percent_by_error"],
        "payload_part_of_effort": payload_part(effort, truth, np.asarray(within)),
        **results,
        "seconds": round(time.perf_counter() - begin, 1),
    }


if __name__ == "__main__":
    main()
