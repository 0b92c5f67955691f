"""The same arms as Pinocchio and C MuJoCo see them, and random states."""

from dataclasses import dataclass
from importlib import resources

import mujoco
import numpy as np
import pinocchio
import yaml

from mjx_inertia.robots import Robot, robot_spec


def figures(name):
    return yaml.safe_load(resources.files("mjx_inertia.robots").joinpath(name).read_text())


def urdf_of(table, inertials, mount, flange_inertial=None):
    """A URDF of published figures, link by link, with nothing merged and nothing rounded."""
    lines = ['<robot name="published"><link name="root"/>']

    def numbers(values):
        return " ".join(repr(float(v)) for v in values)

    def link(name, entry):
        lines.append(f'<link name="{name}">')
        if entry is not None:
            keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
            tensor = " ".join(
                f'{k}="{float(v)!r}"' for k, v in zip(keys, entry["inertia"], strict=True)
            )
            lines.append(
                f'<inertial><origin xyz="{numbers(entry["com"])}" rpy="0 0 0"/>'
                f'<mass value="{entry["mass"]}"/><inertia {tensor}/></inertial>'
            )
        lines.append("</link>")

    def joint(name, kind, parent, child, place, rest=""):
        lines.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{numbers(place["xyz"])}" rpy="{numbers(place["rpy"])}"/>{rest}</joint>'
        )

    link("mount", None)
    joint("to_mount", "fixed", "root", "mount", mount)
    before = "mount"
    for entry, inertial in zip(table["joints"], inertials, strict=True):
        name = entry["name"]
        link(f"{name}_link", inertial)
        limits = entry["limits"]
        joint(
            name,
            "revolute",
            before,
            f"{name}_link",
            entry,
            f'<axis xyz="{numbers(entry["axis"])}"/><limit lower="{limits["lower"]}" '
            f'upper="{limits["upper"]}" velocity="{limits["velocity"]}" '
            f'effort="{limits["torque"]}"/>',
        )
        before = f"{name}_link"
    link("flange", flange_inertial)
    joint("to_flange", "fixed", before, "flange", table["flange"])
    return "\n".join([*lines, "</robot>"])


def baxter_urdf(side="left"):
    table = figures("baxter.yaml")
    inertials = [entry["link"] for entry in table["joints"]]
    return urdf_of(table, inertials, table["mounts"][side], table["flange"]["link"])


def lwa4d_urdf(inertia):
    table = figures("lwa4d.yaml")
    return urdf_of(table, table["inertias"][inertia], {"xyz": [0, 0, 0], "rpy": [0, 0, 0]})


def states(dof, count=1000, seed=0):
    """Positions, velocities, accelerations."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-np.pi, np.pi, (count, dof))
    return q, rng.normal(size=(count, dof)) * 2.0, rng.normal(size=(count, dof)) * 5.0


@dataclass
class Dynamics:
    """Hand position and rotation, Jacobian, J̇q̇, mass matrix, bias, inverse dynamics."""

    position: np.ndarray
    rotation: np.ndarray
    jacobian: np.ndarray
    drift: np.ndarray
    mass_matrix: np.ndarray
    bias: np.ndarray
    torque: np.ndarray


def stack(rows):
    return Dynamics(*(np.array(column) for column in zip(*rows, strict=True)))


def by_pinocchio(model, frame, q, qd, qdd, columns=None):
    """All of it at each state; `columns` are the degrees of freedom meant, in order."""
    data, frame_id, rows = model.createData(), model.getFrameId(frame), []
    axes = pinocchio.LOCAL_WORLD_ALIGNED
    zero = np.zeros(model.nv)
    pick = np.arange(model.nv) if columns is None else np.asarray(columns)
    for state in zip(q, qd, qdd, strict=True):
        full_q, full_qd, full_qdd = pinocchio.neutral(model), zero.copy(), zero.copy()
        for full, part in zip((full_q, full_qd, full_qdd), state, strict=True):
            full[pick] = part
        half = np.triu(pinocchio.crba(model, data, full_q))
        mass = half + np.triu(half, 1).T
        bias = pinocchio.rnea(model, data, full_q, full_qd, zero)
        torque = pinocchio.rnea(model, data, full_q, full_qd, full_qdd)
        pinocchio.forwardKinematics(model, data, full_q, full_qd, zero)
        pinocchio.updateFramePlacements(model, data)
        place = data.oMf[frame_id]
        jacobian = pinocchio.computeFrameJacobian(model, data, full_q, frame_id, axes)
        drift = pinocchio.getFrameClassicalAcceleration(model, data, frame_id, axes).vector
        rows.append(
            (
                place.translation.copy(),
                place.rotation.copy(),
                jacobian[:, pick].copy(),
                drift.copy(),
                mass[np.ix_(pick, pick)],
                bias[pick].copy(),
                torque[pick].copy(),
            )
        )
    return stack(rows)


def by_mujoco(model, site, q, qd, qdd, columns=None):
    """The same by C MuJoCo, with J̇q̇ from its own time derivative of the Jacobian."""
    data, site_id, rows = mujoco.MjData(model), model.site(site).id, []
    body = model.site_bodyid[site_id]
    pick = np.arange(model.nv) if columns is None else np.asarray(columns)
    mass, torque = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
    jacobian, rate = np.zeros((6, model.nv)), np.zeros((6, model.nv))
    for state in zip(q, qd, qdd, strict=True):
        data.qpos[:] = model.qpos0
        for full, part in zip((data.qpos, data.qvel, data.qacc), state, strict=True):
            full[pick] = part
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, mass)
        mujoco.mj_rne(model, data, 1, torque)
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], site_id)
        point = data.site_xpos[site_id]
        mujoco.mj_jacDot(model, data, rate[:3], rate[3:], point, body)
        armature = model.dof_armature[pick] * data.qacc[pick]
        rows.append(
            (
                point.copy(),
                data.site_xmat[site_id].reshape(3, 3).copy(),
                jacobian[:, pick].copy(),
                rate @ data.qvel,
                mass[np.ix_(pick, pick)].copy(),
                data.qfrc_bias[pick].copy(),
                torque[pick] + armature,
            )
        )
    return stack(rows)


def mujoco_of(arm: Robot):
    return robot_spec(arm).compile()


def assert_same(actual: Dynamics, expected: Dynamics, tolerance=1e-10):
    """Each quantity to `tolerance` of its largest entry."""
    for name, value in vars(expected).items():
        error = abs(np.asarray(getattr(actual, name)) - value).max() / abs(value).max()
        assert error < tolerance, f"{name}: relative error {error:.2e}"
