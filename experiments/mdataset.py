"""Table 3.4 of the thesis on the real pushes there are, each object predicted from the others.

    python experiments/mdataset.py dataset.root=PATH [overrides]

The published M-dataset has 11 objects and over 200,000 pushes; what lies below PATH may be a small
subset of it, and the report says how many pushes and objects it read.
"""

import sys

from mjx_inertia.experiment import run_experiment

if __name__ == "__main__":
    run_experiment("mdataset", sys.argv[1:])
