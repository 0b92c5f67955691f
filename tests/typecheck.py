"""The run-time type checker of the tests: beartype on functions, not on the making of records.

JAX rebuilds records with anything in their fields (None, axis numbers, tracers of other shapes),
so a record's shapes are checked by the functions that it crosses, never by its constructor.
"""

from beartype import beartype


def check(function):
    """Checks every call of `function`, unless it is the constructor of a record."""
    return function if function.__name__ == "__init__" else beartype(function)
