"""What the name of a measurement file says about the push in it.

In: `motion_surface=…_shape=…_a=…_v=…_i=…_s=…_t=…[_rep=…].{h5,json}` (Yu et al. 2016). Out:
`McubePush` in SI units. Also the error that every reader of these files raises.
"""

import dataclasses
import math
import re
from pathlib import PurePath

PUSH_LENGTH = 0.05  # m past contact, the same for all pushes

_NAME = re.compile(
    r"motion_surface=(?P<surface>.+?)_shape=(?P<shape>.+?)_a=(?P<a>[^_]+)_v=(?P<v>[^_]+)"
    r"_i=(?P<i>[^_]+)_s=(?P<s>[^_]+)_t=(?P<t>[^_]+?)(?:_rep=(?P<rep>\d+))?"
)
_PATTERN = "motion_surface=…_shape=…_a=…_v=…_i=…_s=…_t=…[_rep=…].h5 or .json"


class McubeFileError(ValueError):
    """A file that is not a push. Arguments: file, key, what was expected, what was found."""

    @property
    def file(self) -> str:
        """Path of the file, or the path through the archive that holds it."""
        return str(self.args[0])

    @property
    def reason(self) -> str:
        """The message without the file."""
        _, key, expected, found = self.args
        return f"{key}: expected {expected}, found {found}"

    def __str__(self) -> str:
        """File, key, expected and found in one line."""
        return f"{self.file}: {self.reason}"


@dataclasses.dataclass(frozen=True)
class McubePush:
    """One push as its file name describes it."""

    surface: str  # name of the table's surface
    shape: str  # name of the object
    acceleration: float  # of the tip, m/s²; 0 for a push at constant speed
    speed: float  # of the tip, m/s; NaN for an accelerated push
    side: int  # index of the pushed side of the outline, from 0
    fraction: float  # along that side, or along the whole curve of a smooth object
    angle: float  # of the tip's path from the inward normal, rad
    repetition: int | None  # number of the repetition, if there were several

    @property
    def nominal_speed(self) -> float:
        """The tip's constant speed, or the one an accelerated push ends with, m/s."""
        if math.isnan(self.speed):
            return math.sqrt(2.0 * self.acceleration * PUSH_LENGTH)
        return self.speed


def parse_name(path: str | PurePath) -> McubePush:
    """Reads the name of a file; the folders above it do not matter.

    Raises:
      McubeFileError: the name does not follow the pattern, or holds a value that is no number.
    """
    name = PurePath(path).name
    found = _NAME.fullmatch(re.sub(r"\.(h5|json)$", "", name, flags=re.IGNORECASE))
    if found is None:
        raise McubeFileError(str(path), "name", _PATTERN, name)
    number: dict[str, float] = {}
    for key in "avist":
        try:
            number[key] = float(found[key])
        except ValueError:
            number[key] = math.nan
        if not math.isfinite(number[key]):
            raise McubeFileError(str(path), f"name, {key}=", "a finite number", found[key])
    if number["a"] < 0.0 or (number["a"] == 0.0 and number["v"] <= 0.0):
        raise McubeFileError(
            str(path), "name", "v > 0, or a > 0 with v=-1", f"a={found['a']}, v={found['v']}"
        )
    return McubePush(
        surface=found["surface"],
        shape=found["shape"],
        acceleration=1e-3 * number["a"],
        speed=math.nan if number["a"] > 0.0 else 1e-3 * number["v"],
        side=round(number["i"]),
        fraction=number["s"],
        angle=number["t"],
        repetition=None if found["rep"] is None else int(found["rep"]),
    )
