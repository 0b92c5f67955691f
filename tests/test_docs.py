"""What the documents name is there: files, modules, functions, links."""

import pkgutil
import re
from pathlib import Path

import pytest

import mjx_inertia as mi

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
FOLDERS = ("mjx_inertia", "experiments", "tests")
FILES = ["/" + path.relative_to(ROOT).as_posix() for f in FOLDERS for path in (ROOT / f).rglob("*")]
# `dataset` is a group of the configuration, too
PACKAGES = {module.name for module in pkgutil.iter_modules(mi.__path__)} - {"dataset"}


@pytest.fixture(params=DOCUMENTS, ids=lambda path: path.name)
def text(request):
    return request.param.read_text()


def is_found(dotted):
    """Whether a dotted name is a module, or an attribute of one."""
    try:
        pkgutil.resolve_name(dotted)
    except (ImportError, AttributeError):
        return False
    return True


def test_files_exist(text):
    named = set(re.findall(r"[\w/]+\.py\b", text))
    assert {name for name in named if not any(f.endswith("/" + name) for f in FILES)} == set()


def test_modules_and_their_names_exist(text):
    named = set(re.findall(r"\bmjx_inertia(?:\.[a-z_]\w*)+", text))
    quoted = re.findall(r"`([a-z_]+(?:\.\w+)+)(?:\([^`]*\))?`", text)
    named |= {f"mjx_inertia.{name}" for name in quoted if name.split(".")[0] in PACKAGES}
    named -= {name for name in named if name.endswith((".py", ".json", ".html", ".csv"))}
    commands = {"mjx_inertia.identify"}  # a command beside the function `mi.identify`
    assert {name for name in named - commands if not is_found(name)} == set()


def test_names_of_the_front_page_exist(text):
    assert set(re.findall(r"\bmi\.([a-zA-Z_]\w*)", text)) <= set(dir(mi))


def test_links_lead_somewhere(text, request):
    folder = request.node.callspec.params["text"].parent
    links = re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text)
    assert [link for link in links if not (folder / link).exists()] == []
