"""What the command lines share: parsers, how a failure ends, tables in plain text."""

import argparse
import sys
from collections.abc import Callable, Collection, Sequence
from typing import NoReturn

from mjx_inertia import runtime


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        """Prints the message and ends the process with status 2."""
        self.exit(2, f"{self.prog}: {message}\n")


def run_command(
    parser: Parser,
    work: Callable[[argparse.Namespace], None],
    arguments: Sequence[str] | None,
    devices: int | None = None,
) -> int:
    """Runs a command line in double precision.

    Args:
      parser: of the arguments.
      work: to do with them; its `ValueError` or `OSError` is printed in one line.
      arguments: of the command line; those of the process if None.
      devices: host devices of the CPU; one a core if None.

    Returns:
      The exit status: 0, or 2 after an error.
    """
    given = parser.parse_args(arguments)
    runtime.configure(devices=devices, float64=True)
    try:
        work(given)
    except (ValueError, OSError) as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 2
    return 0


def aligned(rows: Sequence[Sequence[str]], left: Collection[int] = (0,)) -> list[str]:
    """Rows of cells as lines of text, the columns `left` flush left and the others flush right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
