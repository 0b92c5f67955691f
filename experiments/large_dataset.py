"""Table 3.3 and Figs 3.13, 3.14 of the thesis on 48,000 pushes: its forest, ours, the baseline.

python experiments/large_dataset.py [overrides]
"""

import sys

from mjx_inertia.experiment import run_experiment

if __name__ == "__main__":
    run_experiment("large_dataset", sys.argv[1:])
