"""Table 3.3 and Figs 3.13, 3.14 of the thesis on 48,000 pushes: its forest, ours, the baseline.

python experiments/large_dataset.py [overrides of the sweep]
"""

from pathlib import Path
from typing import Any

from mjx_inertia.experiment import experiment, sweep_result
from mjx_inertia.settings import SweepSettings


@experiment(SweepSettings)
def main(settings: SweepSettings, folder: Path) -> dict[str, Any]:
    """Runs the main job."""
    return sweep_result("large_dataset", settings, folder)


if __name__ == "__main__":
    main()
