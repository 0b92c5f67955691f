"""Files that are written whole or not at all, and archives that are not what they should be."""

import contextlib
import io
import zipfile

import numpy as np
import pytest

from mjx_inertia.files import OtherFormat, read_arrays, write_arrays, write_whole


class Unwritable:
    """NumPy fails at it after it has begun to write."""

    def __array__(self, *_, **__):
        raise RuntimeError("no array")


def test_an_interrupted_write_leaves_what_was_there(tmp_path):
    path = tmp_path / "file.npz"
    write_arrays(path, {"a": np.arange(3)})
    with pytest.raises(RuntimeError, match="no array"):
        write_arrays(path, {"a": np.zeros(1000), "b": Unwritable()})
    with read_arrays(path, "numbers") as arrays:
        np.testing.assert_array_equal(arrays["a"], np.arange(3))
    assert [file.name for file in tmp_path.iterdir()] == ["file.npz"]
    write_whole(path, "µ")
    assert path.read_bytes() == "µ".encode()
    with pytest.raises(FileNotFoundError, match="existing folder"):
        write_whole(tmp_path / "no" / "file", b"")


def test_a_file_of_another_kind_is_named_with_the_remedy(tmp_path):
    path = tmp_path / "file.npz"
    with pytest.raises(FileNotFoundError, match=r"file\.npz: no such file; expected numbers"):
        read_arrays(path, "numbers").__enter__()
    write_arrays(path, {"a": np.arange(1000)})
    content = path.read_bytes()
    np.save(tmp_path / "one.npy", np.arange(3))
    single = (tmp_path / "one.npy").read_bytes()
    for data in (b"", b"text", content[:100], single, content):
        path.write_bytes(data)
        message = r"file\.npz: expected numbers, found .*; delete it"
        with (
            pytest.raises(ValueError, match=message),
            read_arrays(path, "numbers", "; delete it") as a,
        ):
            a["absent"]


def test_forged_sizes_and_encrypted_archives_are_refused_before_reading(tmp_path):
    path = tmp_path / "file.npz"
    write_arrays(path, {"a": np.arange(1000.0)})
    content = path.read_bytes()
    with zipfile.ZipFile(path, "w") as archive:  # 8 TB
        stream = io.BytesIO()
        header = {"descr": "<f8", "fortran_order": False, "shape": (10**12,)}
        np.lib.format.write_array_header_1_0(stream, header)
        archive.writestr("a.npy", stream.getvalue() + b"\0" * 80)
    huge = path.read_bytes()
    locked = bytearray(content)
    locked[6] |= 1  # the flag of encryption, in the member and in the directory
    locked[content.rindex(b"PK\x01\x02") + 8] |= 1
    for data in (huge, bytes(locked)):
        path.write_bytes(data)
        with pytest.raises(ValueError, match=r"file\.npz: expected numbers, found"):
            read_arrays(path, "numbers").__enter__()


def test_a_flipped_bit_is_noticed_or_without_effect(tmp_path):
    path = tmp_path / "file.npz"
    arrays = {"a": np.arange(5.0), "b": np.ones((2, 3))}
    write_arrays(path, arrays)
    content = path.read_bytes()
    for place in range(len(content)):
        flipped = bytearray(content)
        flipped[place] ^= 16
        path.write_bytes(flipped)
        with contextlib.suppress(ValueError), read_arrays(path, "numbers") as found:
            for name, value in arrays.items():
                np.testing.assert_array_equal(found[name], value)


def test_another_format_is_told_apart_from_damage(tmp_path):
    path = tmp_path / "file.npz"
    write_arrays(path, {"version": np.array(2)})
    message = r"file\.npz: expected numbers, version 1, found version 2; delete it"
    with (
        pytest.raises(ValueError, match=message),
        read_arrays(path, "numbers, version 1", "; delete it") as arrays,
    ):
        raise OtherFormat(f"version {arrays['version']}")
