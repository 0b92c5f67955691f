"""Constants of a force sensor and what is behind it, learnt from objects of known mass.

In: the answers of the filter at two probe masses, and the true masses. Out: `Instrument`, as a
JSON file too.
"""

import dataclasses
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from mjx_inertia.files import write_whole

_ROUNDS = 8  # of reweighting
_MODEL_ERROR = 0.05  # of a mass, beside its own deviation: bounds the weight of one push
_HUBER = 1.5  # deviations beyond which a push loses weight
_NORMAL_MEDIAN = 0.455  # of the square of a standard normal error
_HEAVIEST_PROBE = 50.0  # kg


@dataclass(frozen=True)
class Instrument:
    """What a sensor adds to every push; the default is a force measured at the contact itself."""

    probe_mass: float = 0.0  # of what moves between the force sensor and the object, kg
    probe_mass_sd: float = 0.0  # its standard deviation, kg
    # factor of the predicted deviations, at least 1; the errors of the model are correlated, and
    # 1.5 was found on real pushes of three objects
    spread: float = 1.5
    note: str = "force at the contact; not calibrated"

    def __post_init__(self) -> None:
        """Refuses what cannot be meant."""
        for name in ("probe_mass", "probe_mass_sd"):
            value = getattr(self, name)
            if not (isinstance(value, int | float) and 0 <= value < _HEAVIEST_PROBE):
                raise ValueError(f"{name}={value!r}: expected a mass in kg, zero or more")
        if not (isinstance(self.spread, int | float) and 1 <= self.spread < math.inf):
            raise ValueError(f"spread={self.spread!r}: expected a factor of 1 or more")


# Of the robot of Yu et al. 2016, from 35 pushes of three objects of known mass.
MCUBE_INSTRUMENT = Instrument(0.22, 0.02, 1.5, "robot of Yu et al. 2016, from 35 pushes")


def save_instrument(path: str | Path, instrument: Instrument) -> None:
    """Writes a JSON file.

    Raises:
      OSError: the file cannot be written.
    """
    write_whole(Path(path), json.dumps(dataclasses.asdict(instrument), indent=2) + "\n")


def load_instrument(path: str | Path) -> Instrument:
    """Reads a file of `save_instrument`.

    Raises:
      FileNotFoundError: there is no such file.
      ValueError: what is wrong in it.
    """
    expected = f"{path}: expected the instrument file that `calibrate` writes"
    try:
        content = json.loads(Path(path).read_text())
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{expected}; it is no JSON ({error})") from None
    names = {field.name for field in dataclasses.fields(Instrument)}
    if not isinstance(content, dict) or not set(content) <= names:
        raise ValueError(f"{expected}, with the keys {sorted(names)}")
    try:
        return Instrument(**content)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: {error}") from None


@dataclass(frozen=True)
class ProbeLine:
    """Masses of n pushes as a line in the probe mass, which is what they are nearly."""

    total: Float[ndarray, " n"]  # mass where the probe weighed nothing, kg
    slope: Float[ndarray, " n"]  # by which the mass falls with the probe mass
    deviation: Float[ndarray, " n"]  # of the logarithm of the mass

    def mass(self, probe_mass: float) -> Float[ndarray, " n"]:
        """Masses for a probe mass, kg."""
        return self.total - self.slope * probe_mass


def calibrated(line: ProbeLine, mass: Float[ndarray, " n"], obj: Int[ndarray, " n"]) -> Instrument:
    """The instrument that fits pushes of known objects best.

    Args:
      line: of the pushes.
      mass: true masses, kg.
      obj: number of each push's object, from 0: the scatter between objects is the error of the
        probe mass.

    Raises:
      ValueError: fewer than two pushes.
    """
    if len(mass) < 2:
        raise ValueError(f"calibrate: {len(mass)} usable pushes; give two or more, faster ones")

    def fitted(rows: ndarray) -> float:
        total, slope, true = line.total[rows], line.slope[rows], mass[rows]
        probe = 0.0
        for _ in range(_ROUNDS):
            error = total - slope * probe - true
            weight = 1.0 / ((line.deviation[rows] ** 2 + _MODEL_ERROR**2) * true**2)
            weight /= np.maximum(1.0, np.abs(error) * np.sqrt(weight) / _HUBER)
            probe += float(np.sum(weight * slope * error) / np.sum(weight * slope**2))
        return max(probe, 0.0)

    everything = np.arange(len(mass))
    probe = fitted(everything)
    # standard error of the mean over objects; of one object nothing is known of it
    each = [fitted(np.flatnonzero(obj == k)) for k in np.unique(obj)]
    scatter = np.std(each, ddof=1) / math.sqrt(len(each)) if len(each) > 1 else 0.1 * probe
    relative = (line.mass(probe) / mass - 1.0) ** 2 / line.deviation**2
    spread = max(1.0, math.sqrt(float(np.median(relative)) / _NORMAL_MEDIAN))
    note = f"calibrated on {len(mass)} pushes of {len(each)} objects"
    return Instrument(round(probe, 5), round(float(scatter), 5), round(spread, 4), note)
