"""Files that are written whole or not at all; archives and XML that say what is wrong with them.

In: a path and bytes, text or arrays by name. Out: the file; or the arrays of an `.npz` file again,
or the root element of an XML file.
"""

import contextlib
import lzma
import math
import os
import re
import struct
import uuid
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO
from xml.etree import ElementTree as ET

import numpy as np
import yaml
from numpy import ndarray

# What NumPy, zipfile and the code that uses the arrays raise for files that are not as expected.
_UNEXPECTED = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    OSError,
    OverflowError,
    RuntimeError,  # encrypted, or packed in a way that zipfile does not know
    TypeError,
    ValueError,
)


class OtherFormat(ValueError):
    """An archive that is whole but of another kind or version; says which it is."""


def check_writable(path: Path) -> None:
    """Finds out before work that takes its time whether its file can be written.

    Raises:
      OSError: it is a folder, or there is no folder to write it into.
    """
    if path.is_dir():
        raise OSError(f"{path}: is a folder; the file cannot be written")
    if not path.parent.is_dir():
        raise OSError(
            f"{path}: expected a folder to write into, found none at {path.parent}: the file "
            "cannot be written"
        )
    if not os.access(path.parent, os.W_OK):
        raise OSError(f"{path}: {path.parent} is read-only; the file cannot be written")


def write_whole(path: Path, content: bytes | str) -> None:
    """Writes `content` to `path`; an older file stays until the new one is done.

    Raises:
      FileNotFoundError: the folder does not exist.
      OSError: the folder cannot be written into.
    """
    with _whole(path) as stream:
        stream.write(content.encode() if isinstance(content, str) else content)


def write_arrays(path: Path, arrays: Mapping[str, ndarray], *, compress: bool = False) -> None:
    """Writes arrays to an `.npz` file; an older file stays until the new one is done.

    Raises:
      FileNotFoundError: the folder does not exist.
      OSError: the folder cannot be written into.
    """
    save = np.savez_compressed if compress else np.savez
    with _whole(path) as stream:
        save(stream, allow_pickle=False, **arrays)


@contextlib.contextmanager
def read_arrays(path: Path, expected: str, remedy: str = "") -> Iterator[dict[str, ndarray]]:
    """Arrays of an `.npz` file by name, to be used in a `with` block.

    What goes wrong in the block, such as an array that is missing, is reported as a fault of the
    file; `OtherFormat` as what it says was found.

    Args:
      path: of the file.
      expected: what the file should be, for the message.
      remedy: what to do about a damaged file, for the message.

    Raises:
      FileNotFoundError: there is no such file.
      ValueError: the file is truncated, damaged, of another kind or of another version.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; expected {expected}")
    try:
        with zipfile.ZipFile(path) as archive:
            for member in archive.infolist():
                _check_size(archive, member)
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        yield arrays
    except OtherFormat as error:
        raise ValueError(f"{path}: expected {expected}, found {error}{remedy}") from None
    except _UNEXPECTED as error:
        raise ValueError(
            f"{path}: expected {expected}, found a file that is truncated, damaged or of another "
            f"kind ({error}){remedy}"
        ) from error


def parse_yaml(text: str, where: str) -> Any:
    """The content of YAML without aliases: a few lines of aliases can stand for any amount of data.

    Raises:
      ValueError: an alias, or something else than YAML, in the file that `where` names.
    """
    try:
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text)):
            raise ValueError(f"{where}: aliases (*name) are not read; write the numbers out")
        return yaml.safe_load(text)
    except (yaml.YAMLError, RecursionError) as error:
        raise ValueError(f"{where}: not a YAML file ({error})") from None


def read_xml(path: Path) -> ET.Element:
    """The root element of XML as it is found: blank lines first, prefixes without namespace.

    Tags in the default namespace are without it.

    Raises:
      ValueError: the file is not XML.
    """
    text = path.read_bytes().strip()
    try:
        text.decode()
    except UnicodeDecodeError:  # mostly a comment in Latin-1
        text = re.sub(rb"^<\?xml.*?\?>", b"", text).decode("latin-1").encode()
    used = set(re.findall(rb"[<\s]([A-Za-z_][\w.-]*):[A-Za-z_]", text)) - {b"xml", b"xmlns"}
    unbound = [name for name in sorted(used) if b"xmlns:" + name not in text]
    bound = b"".join(b" xmlns:%s='urn:%s'" % (name, name) for name in unbound)
    try:
        root = ET.fromstring(re.sub(rb"<(robot|mujoco)\b", rb"<\1" + bound, text, count=1))
    except (ET.ParseError, LookupError, ValueError) as error:
        raise ValueError(f"{path}: not an XML file ({error})") from None
    default = root.tag.partition("}")[0] + "}" if root.tag.startswith("{") else ""
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.removeprefix(default)
    return root


def _check_size(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> None:
    """Raises ValueError for an array that is not as large as its header says.

    NumPy allocates what the header declares before it reads.
    """
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        header = (
            np.lib.format.read_array_header_1_0
            if version == (1, 0)
            else np.lib.format.read_array_header_2_0
        )
        shape, _, dtype = header(stream)
        declared = stream.tell() + math.prod(shape) * dtype.itemsize
    if declared != member.file_size:
        raise ValueError(f"{member.filename} declares {declared} bytes, has {member.file_size}")


@contextlib.contextmanager
def _whole(path: Path) -> Iterator[BinaryIO]:
    """A stream to a file beside `path` that takes its place when the block ends well."""
    if not path.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path}: expected an existing folder {path.parent}")
    partial = path.with_name(f".{path.name}.{uuid.uuid4().hex}.partial")
    try:
        stream = partial.open("xb")
    except OSError as error:
        raise OSError(f"{path}: cannot write into {path.parent} ({error.strerror})") from None
    try:
        with stream:
            yield stream
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
