"""A robot file as this package and as Pinocchio or C MuJoCo read it, chain by chain.

In: a URDF or MJCF file. Out: for each chain of joints from the base to a leaf whether mass matrix
and gravity torques agree, or why they were not compared.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import jax.numpy as jnp
import mujoco
import numpy as np
import pinocchio
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.robots import gravity_torque, load_robot, mass_matrix

RIGHT, RIGHT_UNCOUPLED, WRONG, REFUSED, TRACEBACK, NO_REFERENCE = OUTCOMES = (
    "right",
    "right with ignore_couplings",
    "wrong",
    "refused",
    "traceback",
    "no reference",
)
TOLERANCE = 1e-9  # relative to the largest entry
_HEAD = 4096  # bytes in which the root element of a file is looked for


@dataclass(frozen=True)
class Outcome:
    """What became of a chain, or of a file without a reference."""

    file: str
    end: str  # link or body at the end of the chain
    kind: str  # of OUTCOMES
    detail: str = ""  # why; the relative error of a wrong one


@dataclass(frozen=True)
class Chain:
    """Joints from the base to a leaf."""

    end: str  # link or body that the last joint moves
    joints: tuple[str, ...]  # names, from the base on
    base: str  # link or body with the free joint that the chain hangs on, or the root


@dataclass(frozen=True)
class Torques:
    """Of a chain at one state."""

    mass_matrix: Float[ndarray, "n n"]
    gravity: Float[ndarray, " n"]
    scale: float  # of gravity torques, N m: weight at the radius of gyration


class PinocchioReference:
    """A URDF file in Pinocchio, joints that mimic others independent as is its default."""

    def __init__(self, path: Path) -> None:
        """Raises ValueError or RuntimeError if Pinocchio does not read it."""
        self.model = pinocchio.buildModelFromUrdf(str(path))
        self.data = self.model.createData()
        # prefixes whose namespace is not declared are no XML, and there are files with them
        text = re.sub(rb"(</?|\s)\w+:(\w)", rb"\1\2", path.read_bytes().strip())
        joints = ET.fromstring(text).findall("joint")
        self.mimics = {j.get("name", ""): m.attrib for j in joints for m in j.findall("mimic")}

    def chains(self) -> list[Chain]:
        """One for each set of joints that ends at a link without others behind it."""
        frames = list(self.model.frames)
        before = {frame.parentFrame for frame in frames[1:]}
        leaves = [f for i, f in enumerate(frames) if i and i not in before]
        bodies = [f for f in leaves if f.type == pinocchio.FrameType.BODY]
        found: dict[tuple[str, ...], Chain] = {}
        for body in bodies:
            joints = list(self.model.supports[body.parentJoint])[1:]
            free = [j for j in joints if self.model.joints[j].nv == 6]
            names = tuple(self.model.names[j] for j in joints[len(free) :])
            if names:
                found.setdefault(names, Chain(body.name, names, self._child(free)))
        return list(found.values())

    def torques(self, chain: Chain, positions: Float[ndarray, " n"]) -> Torques:
        """With all other joints at zero, or where they mimic others that are at zero."""
        model = self.model
        pick = [model.joints[model.getJointId(name)].idx_v for name in chain.joints]
        step = np.zeros(model.nv)
        for name in self.mimics:
            step[model.joints[model.getJointId(name)].idx_v] = self._held(name)
        step[pick] = positions
        q = pinocchio.integrate(model, pinocchio.neutral(model), step)
        upper = np.triu(pinocchio.crba(model, self.data, q))
        matrix = (upper + np.triu(upper, 1).T)[np.ix_(pick, pick)]
        gravity = pinocchio.computeGeneralizedGravity(model, self.data, q)[pick]
        weight = 9.81 * pinocchio.computeTotalMass(model)
        return Torques(matrix, gravity, weight * _gyration(matrix, weight / 9.81))

    def _held(self, name: str) -> float:
        rule = self.mimics.get(name)
        if rule is None:
            return 0.0
        before = self._held(rule["joint"])
        return float(rule.get("multiplier", 1.0)) * before + float(rule.get("offset", 0.0))

    def _child(self, free: list[int]) -> str:
        """The link that the last free joint moves; the root without one."""
        joint = free[-1] if free else 0
        bodies = [f for f in self.model.frames if f.type == pinocchio.FrameType.BODY]
        return next(f.name for f in bodies if f.parentJoint == joint)


class MujocoReference:
    """An MJCF file in C MuJoCo."""

    def __init__(self, path: Path) -> None:
        """Raises ValueError if MuJoCo does not compile it."""
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)

    def chains(self) -> list[Chain]:
        """One for each set of joints that ends at a body without others behind it."""
        model = self.model
        leaves = set(range(1, model.nbody)) - set(model.body_parentid.tolist())
        found: dict[tuple[str, ...], Chain] = {}
        for leaf in sorted(leaves):
            joints: list[int] = []
            body, end, base = leaf, "", "world"
            while body > 0 and base == "world":
                first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
                if count and model.jnt_type[first] == mujoco.mjtJoint.mjJNT_FREE:
                    base = model.body(body).name
                else:
                    joints = [*range(first, first + count), *joints]
                    end = end or model.body(body).name
                body = int(model.body_parentid[body])
            names = tuple(model.joint(j).name or f"joint {j}" for j in joints)
            if names and end and base:
                found.setdefault(names, Chain(end, names, base))
        return list(found.values())

    def torques(self, chain: Chain, positions: Float[ndarray, " n"]) -> Torques:
        """With all other joints at `qpos0`."""
        model, data = self.model, self.data
        joints = [self._joint(name) for name in chain.joints]
        pick = [int(model.jnt_dofadr[j]) for j in joints]
        data.qpos[:], data.qvel[:] = model.qpos0, 0.0
        data.qpos[[int(model.jnt_qposadr[j]) for j in joints]] = positions
        for stage in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_tendon, mujoco.mj_makeM):
            stage(model, data)
        mujoco.mj_comVel(model, data)
        full, bias = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
        mujoco.mj_fullM(model, data, full)
        mujoco.mj_rne(model, data, 0, bias)
        matrix, mass = full[np.ix_(pick, pick)], float(model.body_mass.sum())
        weight = mass * float(np.linalg.norm(model.opt.gravity))
        return Torques(matrix, bias[pick], weight * _gyration(matrix, mass))

    def _joint(self, name: str) -> int:
        j = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, name)
        return j if j >= 0 else int(name.removeprefix("joint "))


def kind_of_file(path: Path) -> str:
    """`urdf`, `mjcf`, or empty if it is neither."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    root = re.search(rb"<(robot|mujoco)[\s>]", re.sub(rb"<!--.*?-->", b"", head, flags=re.S))
    return "" if root is None else {b"robot": "urdf", b"mujoco": "mjcf"}[root[1]]


def compare_file(path: Path, most: int, states: int) -> list[Outcome]:
    """The chains of a file.

    Args:
      path: of a URDF or MJCF file.
      most: chains that are compared.
      states: random states of each.
    """
    try:
        load_robot(path, "no link has this name")
    except (ValueError, FileNotFoundError) as error:
        first = _refusal(path, "", error)
    except Exception as error:
        first = _unexpected(path, "", error)
    if first.kind == TRACEBACK:
        return [first]
    kinds = {"urdf": PinocchioReference, "mjcf": MujocoReference}
    try:
        reference = kinds[kind_of_file(path)](path)
    except Exception as error:  # whatever another program throws
        return [Outcome(str(path), "", NO_REFERENCE, _general(path, str(error)))]
    chains = reference.chains()
    return [compare_chain(path, reference, chain, states) for chain in chains[:most]]


def compare_chain(
    path: Path, reference: PinocchioReference | MujocoReference, chain: Chain, states: int
) -> Outcome:
    """One chain at random states, its coupled joints taken as independent if there are some."""
    kind = RIGHT
    try:
        try:
            robot = load_robot(path, chain.end, chain.base)
        except ValueError as error:
            if "ignore_couplings" not in str(error):
                raise
            robot = load_robot(path, chain.end, chain.base, ignore_couplings=True)
            kind = RIGHT_UNCOUPLED
        names = robot.joint_names
        if names != chain.joints:
            return Outcome(str(path), chain.end, WRONG, f"joints {names}, not {chain.joints}")
        rng, worst = np.random.default_rng(0), 0.0
        for _ in range(states):
            q = rng.uniform(-1.0, 1.0, robot.dof)
            expected = reference.torques(chain, q)
            matrix = np.asarray(mass_matrix(robot, jnp.asarray(q)))
            gravity = np.asarray(gravity_torque(robot, jnp.asarray(q)))
            largest = np.abs(expected.mass_matrix).max() or 1.0
            worst = max(
                worst,
                np.abs(matrix - expected.mass_matrix).max() / largest,
                np.abs(gravity - expected.gravity).max() / (expected.scale or 1.0),
            )
    except (ValueError, FileNotFoundError) as error:
        return _refusal(path, chain.end, error)
    except Exception as error:
        return _unexpected(path, chain.end, error)
    if worst <= TOLERANCE:
        return Outcome(str(path), chain.end, kind)
    return Outcome(str(path), chain.end, WRONG, f"relative error {worst:.1e}")


def _refusal(path: Path, end: str, error: Exception) -> Outcome:
    """A sentence that does not name the file counts as a traceback."""
    if str(path) not in str(error):
        return _unexpected(path, end, error)
    return Outcome(str(path), end, REFUSED, _general(path, str(error)))


def _unexpected(path: Path, end: str, error: Exception) -> Outcome:
    return Outcome(str(path), end, TRACEBACK, f"{type(error).__name__}: {error}")


def _general(path: Path, message: str) -> str:
    """A message without what differs from file to file."""
    text = message.replace(f"{path}: ", "").replace(str(path), "…")
    return re.split(r"[,;(\n]", re.sub(r"'[^']*'|[-\d.e]*\d", "…", text))[0].strip()


def _gyration(matrix: Float[ndarray, "n n"], mass: float) -> float:
    """Radius of gyration of the largest entry, m."""
    return float(np.sqrt(np.abs(matrix).max() / mass)) if mass > 0.0 else 0.0
