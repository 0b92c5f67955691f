"""The catalogue at the command line: `python -m mjx_inertia.objects`.

Without a command it lists the objects; `gallery FILE` draws them; `export DIR` writes them as URDF
and MJCF.
"""

import argparse
import sys
from collections.abc import Sequence

from mjx_inertia.command import Parser, run_command
from mjx_inertia.objects.catalogue.load import CATEGORIES, load_catalogue
from mjx_inertia.objects.export import FORMATS, export_objects
from mjx_inertia.objects.gallery import gallery, object_table

_COMMANDS = ("list", "gallery", "export")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit status."""
    return run_command(_parser(), _run, arguments, devices=1)


def _run(given: argparse.Namespace) -> None:
    for option, values in (("--names", given.names), ("--category", given.category)):
        if commands := [value for value in values if value in _COMMANDS]:
            raise ValueError(f"{commands[0]!r} is a command; put {option} after the command")
    objects = load_catalogue(given.names or None, category=given.category or None)
    if given.command == "gallery":
        gallery(objects, given.file)
        print(f"{len(objects)} objects in {given.file}")
    elif given.command == "export":
        export_objects(objects, given.folder, given.format)
        print(f"{len(objects)} objects in {given.folder}")
    else:
        print(object_table(objects.values()))
        print(f"{len(objects)} objects")


def _parser() -> Parser:
    which = _which(argparse.SUPPRESS)  # a default here would replace what stands before the command
    parser = Parser(
        prog="python -m mjx_inertia.objects",
        description="Objects with meshes and true inertial parameters.",
        parents=[_which([])],
    )
    parser.set_defaults(command="list")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    commands.add_parser("list", help="a table of all (the default)", parents=[which])
    sheet = commands.add_parser("gallery", help="a labelled sheet of all", parents=[which])
    sheet.add_argument("file", metavar="FILE", help="to write, .png or .html")
    files = commands.add_parser(
        "export", help="a folder for each, as URDF and MJCF", parents=[which]
    )
    files.add_argument("folder", metavar="DIR", help="to write into; made if it does not exist")
    files.add_argument(
        "--format", nargs="+", default=FORMATS, choices=FORMATS, help="both if not given"
    )
    return parser


def _which(default: object) -> Parser:
    """The options that choose objects."""
    which = Parser(add_help=False)
    which.add_argument("--names", nargs="+", default=default, help="these objects only")
    which.add_argument("--category", nargs="+", default=default, help=f"of {', '.join(CATEGORIES)}")
    return which


if __name__ == "__main__":
    sys.exit(main())
