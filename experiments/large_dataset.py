"""Table 3.3 and Figs 3.13, 3.14 of the thesis: its forest, ours, and the baseline, on 48,000 pushes.

python experiments/large_dataset.py [overrides]
"""

import sys

from mjx_inertia.experiment import run_experiment

if __name__ == "__main__":
    run_experiment("large_dataset", sys.argv[1:])
