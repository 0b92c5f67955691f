"""A tree of files as one batch, its broken files listed, its archives read in place."""

import shutil
import zipfile

import jax
import numpy as np
import pytest
from dataset.mcube_files import NAME, OBJECTS, TIP_RADIUS, Push, h5_bytes, write_h5, write_json

from mjx_inertia.dataset.mcube import load_mcube
from mjx_inertia.dataset.mcube_folder import load_mcube_folder
from mjx_inertia.objects import cuboid
from mjx_inertia.pushing import PushStatus

BOX = NAME.replace("shape=tile", "shape=box")
MODELS = {**OBJECTS, "box": cuboid((0.1, 0.08, 0.02), 1.5, name="box")}


class Slow(Push):
    moving = 1.0


@pytest.fixture
def tree(tmp_path):
    raw = tmp_path / "mcube_raw"
    write_h5(raw / "felt" / "tile", Push().tables())
    write_json(raw / "felt" / "box", Slow().tables(), BOX + "_rep=0001")
    return tmp_path


def test_batch_is_padded_and_in_order(tree):
    result = load_mcube_folder(tree, MODELS, 100.0, TIP_RADIUS, progress=False)
    assert result.objects == ("box", "tile")
    assert [name.split("/")[1] for name in result.files] == ["box", "tile"]
    assert not result.failures and not result.duplicates
    batch = result.batch
    np.testing.assert_array_equal(batch.conditions.object_id, [0, 1])
    np.testing.assert_allclose(batch.truth.mass, [1.5, 0.9])
    lengths = np.asarray(batch.records.length)
    assert batch.records.force.shape == (2, lengths.max(), 2)
    assert lengths[0] > lengths[1]
    assert np.all(batch.records.force[1, lengths[1] :] == batch.records.force[1, lengths[1] - 1])
    alone = load_mcube(tree / "mcube_raw" / result.files[1], MODELS, 100.0, TIP_RADIUS)
    cut = jax.tree.map(lambda leaf: leaf[1, : lengths[1]], batch.records.pose)
    np.testing.assert_array_equal(cut, alone.pose)
    inner = load_mcube_folder(tree / "mcube_raw" / "felt", MODELS, progress=False)
    assert inner.objects == result.objects


def test_broken_files_are_listed_and_the_rest_goes_on(tree):
    folder = tree / "mcube_raw" / "felt" / "tile"
    good = Push().tables()
    write_h5(folder, good, NAME.replace("tile", "moon"))
    write_h5(folder, {"tip_pose": good["tip_pose"]}, NAME + "_rep=0002")
    (folder / (NAME + "_rep=0003.h5")).write_bytes(h5_bytes(good)[:-2000])
    (folder / (NAME + "_rep=0004.json")).write_bytes(b"")
    (folder / "notes.json").write_text("{}")
    (folder / "readme.txt").write_text("no push")
    (folder / "broken.zip").write_bytes(b"PK no archive")
    still = Push().tables()
    still["ft_wrench"][:, 1:] = 1.0
    write_h5(folder, still, NAME + "_rep=0005")
    result = load_mcube_folder(tree, MODELS, progress=False)
    reasons = {failure.file.rsplit("/", 1)[1]: failure.reason for failure in result.failures}
    assert len(reasons) == 6
    assert "pass `objects`" in reasons[NAME.replace("tile", "moon") + ".h5"]
    assert (
        "ft_wrench" in reasons[NAME + "_rep=0002.h5"]
        or "object_pose" in reasons[NAME + "_rep=0002.h5"]
    )
    assert "HDF5" in reasons[NAME + "_rep=0003.h5"]
    assert "empty" in reasons[NAME + "_rep=0004.json"]
    assert "motion_surface=" in reasons["notes.json"]
    assert "zip" in reasons["broken.zip"]
    assert len(result.files) == 3
    assert sorted(np.asarray(result.batch.records.status)) == [0, 0, PushStatus.FROZEN_FORCE]


def test_no_file_of_whatever_kind_ends_the_reading(tree):
    folder = tree / "mcube_raw" / "felt" / "tile"
    number = "[[" + "9" * 400 + ", 0, 0, 0]]"
    long = "{" + ", ".join(f'"{k}": {number}' for k in ("object_pose", "tip_pose", "ft_wrench"))
    (folder / (NAME + "_rep=0001.json")).write_text(long + "}")
    (folder / (NAME + "_rep=0002.json")).write_text("[" * 100_000)
    packed = folder / "packed.zip"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr(NAME + "_rep=0003.h5", h5_bytes(Push().tables()))
    content = bytearray(packed.read_bytes())
    content[len(content) // 2] ^= 16
    packed.write_bytes(content)
    result = load_mcube_folder(tree, MODELS, progress=False)
    assert len(result.files) == 2
    assert {failure.file.rsplit("rep=", 1)[1] for failure in result.failures} == {
        "0001.json", "0002.json", "0003.h5"
    }  # fmt: skip


def test_archives_are_read_in_place(tree):
    plain = load_mcube_folder(tree, MODELS, progress=False)
    raw = tree / "mcube_raw"
    packed = tree / "packed"
    packed.mkdir()
    with zipfile.ZipFile(packed / "felt.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(raw.rglob("*.*")):
            archive.write(path, path.relative_to(raw))
        archive.writestr("__MACOSX/._" + NAME + ".h5", b"resource fork")
        archive.writestr(NAME + "_rep=0009.h5", b"not a push")
    result = load_mcube_folder(packed, MODELS, progress=False)
    assert [name.split("/")[0] for name in result.files] == ["felt.zip"] * 2
    assert len(result.failures) == 1
    assert jax.tree.all(
        jax.tree.map(lambda a, b: np.array_equal(a, b, equal_nan=True), plain.batch, result.batch)
    )
    assert sorted(path.name for path in packed.iterdir()) == ["felt.zip"]
    # A member can be read alone, and the same push is not counted twice.
    load_mcube(packed / result.files[0], MODELS)
    shutil.copytree(raw / "felt", packed / "unpacked")
    both = load_mcube_folder(packed, MODELS, progress=False)
    assert len(both.files) == 2
    assert len(both.duplicates) == 2


def test_nothing_to_read(tmp_path):
    with pytest.raises(FileNotFoundError, match="no folder"):
        load_mcube_folder(tmp_path / "none")
    with pytest.raises(FileNotFoundError, match=r"no \.h5"):
        load_mcube_folder(tmp_path, MODELS)
    (tmp_path / "notes.json").write_text("{}")
    with pytest.raises(ValueError, match="none of 1 files is a push"):
        load_mcube_folder(tmp_path, MODELS, progress=False)
