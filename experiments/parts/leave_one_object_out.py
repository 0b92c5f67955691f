"""Real pushes identified by the measured force, each object with an instrument of the others.

In: a folder in the layout of the M-dataset, and its objects. Out: a table of single pushes, and of
all pushes of each object together with the CoM known and unknown.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_inertia.dataset import load_mcube_folder
from mjx_inertia.dataset.mcube_file import parse_name
from mjx_inertia.dataset.recording import MeasuredPush, read_push
from mjx_inertia.objects import ObjectModel
from mjx_inertia.recorded.body import calibrate_instrument, identify_recorded

INFORMATIVE = 0.15  # predicted relative deviation of the mass
INERTIA_KNOWN = 0.30  # the same of I_zz


@dataclass(frozen=True)
class ForceDrivenTable:
    """Relative errors of single pushes with known CoM, and what joint fits give."""

    name: np.ndarray  # of the object
    mass: Float[np.ndarray, "n 2"]  # relative error and predicted deviation
    inertia: Float[np.ndarray, "n 2"]
    together: dict[str, dict[str, float]]  # by object: percent and mm
    probe_mass: dict[str, float]  # kg, calibrated on the other objects

    def figures(self) -> dict[str, Any]:
        """The headline entries."""
        error, deviation = self.mass.T
        told = deviation < INFORMATIVE
        turning, inertia_deviation = self.inertia.T
        turned = inertia_deviation < INERTIA_KNOWN
        values = {
            "median_abs_mass_percent_informative": _median(error[told]),
            "median_abs_mass_percent_usable": _median(error[np.isfinite(error)]),
            "signed_mean_mass_percent": 100.0 * float(error[told].mean()),
            "mass_z_rms": _rms(error[told] / deviation[told]),
            "median_abs_inertia_percent": _median(turning[turned]),
            "inertia_z_rms": _rms(turning[turned] / inertia_deviation[turned]),
        }
        counts = {
            "usable": len(error),
            "converged": int(np.isfinite(error).sum()),
            "informative": int(told.sum()),
            "inertia_told": int(turned.sum()),
        }
        rounded = {name: round(value, 3) for name, value in values.items()}
        return {**counts, **rounded, "together": self.together, "probe_mass_kg": self.probe_mass}


def _median(x: Float[np.ndarray, " n"]) -> float:
    return 100.0 * float(np.median(np.abs(x))) if len(x) else float("nan")


def _rms(x: Float[np.ndarray, " n"]) -> float:
    return float(np.sqrt(np.mean(x**2))) if len(x) else float("nan")


def leave_one_object_out(root: Path, objects: dict[str, ObjectModel]) -> ForceDrivenTable:
    """Every usable push below a folder, by the instrument that the other objects calibrate."""
    folder = load_mcube_folder(root, objects, progress=False)
    below = root / "mcube_raw" if (root / "mcube_raw").is_dir() else root
    usable = np.asarray(folder.batch.records.status) == 0
    files = [file for file, ok in zip(folder.files, usable, strict=True) if ok]
    names = np.array([parse_name(file).shape for file in files])
    pushes = [_read(below / f, objects[n]) for f, n in zip(files, names, strict=True)]
    rows: list[tuple[np.ndarray, ...]] = []
    together: dict[str, dict[str, float]] = {}
    probes: dict[str, float] = {}
    for name in np.unique(names):
        own, others = names == name, np.flatnonzero(names != name)
        known = [float(np.asarray(objects[names[i]].inertial.mass)) for i in others]
        instrument = calibrate_instrument([pushes[i] for i in others], known)
        probes[str(name)] = round(instrument.probe_mass, 3)
        mine = [push for push, is_own in zip(pushes, own, strict=True) if is_own]
        truth = objects[name].inertial
        scale = np.array([float(truth.mass), float(np.asarray(truth.inertia)[2, 2])])
        found = identify_recorded(mine, instrument=instrument)
        for alone in found.alone:
            mean, covariance = alone or (np.full(4, np.nan), np.diag(np.full(4, np.inf)))
            error = mean[:2] / scale - 1.0
            deviation = np.sqrt(np.diagonal(covariance)[:2]) / scale
            rows.append(
                (name, np.array([error[0], deviation[0]]), np.array([error[1], deviation[1]]))
            )
        free = identify_recorded(
            [dataclasses.replace(push, com=None) for push in mine], instrument=instrument
        )
        together[str(name)] = _joint(found, free, scale, _com(objects[name]))
    columns = list(zip(*rows, strict=True))
    return ForceDrivenTable(
        np.array(columns[0]), np.array(columns[1]), np.array(columns[2]), together, probes
    )


def _read(path: Path, obj: ObjectModel) -> MeasuredPush:
    return read_push(path, obj, com=_com(obj))


def _com(obj: ObjectModel) -> Float[np.ndarray, "2"]:
    return np.asarray(obj.inertial.com, float)[:2]


def _joint(found: Any, free: Any, scale: np.ndarray, com: np.ndarray) -> dict[str, float]:
    """Errors of the fits of all pushes of an object: mass with known CoM; mass and CoM without."""
    values = {
        "pushes": float(sum(alone is not None for alone in found.alone)),
        "mass_percent": 100.0 * (found.mean[0] / scale[0] - 1.0),
        "mass_sd_percent": 100.0 * float(np.sqrt(found.covariance[0, 0])) / scale[0],
        "com_free_mass_percent": 100.0 * (free.mean[0] / scale[0] - 1.0),
        "com_error_mm": 1e3 * float(np.hypot(*(free.fit.mean[2:] - com))),
        "com_sd_mm": 1e3 * float(np.sqrt(np.trace(free.fit.covariance[2:, 2:]))),
    }
    return {key: round(float(value), 2) for key, value in values.items()}
