"""A digest of all code of this library that a module runs on: it tells when a cached result is old.

In: a module. Out: the digest of its source and of the sources that it imports, and so on.
"""

import ast
import functools
import hashlib
import importlib.util
import inspect
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

_LIBRARY = __name__.partition(".")[0]


@functools.cache
def code_digest(module: ModuleType) -> str:
    """SHA-256 of the `sources` of a module."""
    digest = hashlib.sha256()
    for path in sources(module):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def sources(module: ModuleType) -> list[Path]:
    """Files of a module, those of this library that it imports, and those that they import."""
    waiting, seen = [Path(inspect.getsourcefile(module) or "")], set()
    while waiting:
        path = waiting.pop()
        if path not in seen:
            seen.add(path)
            waiting += _imported(path)
    return sorted(seen)


@functools.cache
def _imported(path: Path) -> tuple[Path, ...]:
    return tuple(_imports(ast.parse(path.read_text())))


def _imports(tree: ast.Module) -> Iterator[Path]:
    """Files of this library that `from x import y` names: y where it is a module, else x."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == _LIBRARY:
            for alias in node.names:
                yield _file(f"{node.module}.{alias.name}") or _file(node.module) or Path()


def _file(name: str | None) -> Path | None:
    try:
        found = importlib.util.find_spec(name or "")
    except (ModuleNotFoundError, ValueError):  # no package, so it is a name in a module
        return None
    return Path(found.origin) if found and found.origin else None
