"""One name, one meaning: no public name stands in two modules, and none hides a module."""

import ast
from collections import defaultdict
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "mjx_inertia"
CATALOGUE = PACKAGE / "objects" / "catalogue"
MODULES = {path: ast.parse(path.read_text()) for path in sorted(PACKAGE.rglob("*.py"))}


def is_exempt(path: Path, node: ast.stmt) -> bool:
    """`main` of a command line, and builders of the catalogue, which bear their object's name."""
    if isinstance(node, ast.FunctionDef) and node.name == "main":
        return path.stem in {"__main__", "sweep"}
    if "overload" in [ast.unparse(d) for d in getattr(node, "decorator_list", [])]:
        return True
    returns = ast.unparse(node.returns) if getattr(node, "returns", None) else ""
    return path.parent == CATALOGUE and returns == "tuple[Part, ...]"


def is_command(folder: Path) -> bool:
    """A package to be run, in which there is nothing to import."""
    return {path.name for path in folder.glob("*.py")} == {"__init__.py", "__main__.py"}


def test_a_public_name_is_defined_once():
    places = defaultdict(list)
    for path, module in MODULES.items():
        for node in module.body:
            if not isinstance(node, ast.FunctionDef | ast.ClassDef) or is_exempt(path, node):
                continue
            if not node.name.startswith("_"):
                places[node.name].append(path.relative_to(PACKAGE).as_posix())
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_no_module_is_hidden_by_what_its_package_exports():
    hidden = set()
    for path, module in MODULES.items():
        if path.name != "__init__.py":
            continue
        modules = {other.stem for other in path.parent.glob("*.py")}
        packages = [other.parent for other in path.parent.glob("*/__init__.py")]
        modules |= {other.name for other in packages if not is_command(other)}
        package = ".".join(path.parent.relative_to(PACKAGE.parent).parts)
        for node in ast.walk(module):
            # `from package import module` gives the module itself
            if isinstance(node, ast.ImportFrom) and node.module != package:
                exported = {alias.asname or alias.name for alias in node.names}
                hidden |= {f"{package}.{name}" for name in exported & modules}
    assert hidden == set()
