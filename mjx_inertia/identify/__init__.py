"""The command `python -m mjx_inertia.identify`."""
