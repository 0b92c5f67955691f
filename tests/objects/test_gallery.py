"""Pictures, tables and the command line."""

import numpy as np
import pytest
import trimesh
from matplotlib.image import imread

from mjx_inertia.objects import cuboid, load_catalogue
from mjx_inertia.objects.__main__ import main
from mjx_inertia.objects.gallery import gallery, object_table, portrait, summarize_object
from mjx_inertia.objects.picture import View, draw_meshes


def test_what_is_nearer_hides_what_is_behind():
    """A red wall in front of a green one, then the view from the other side."""
    walls = [trimesh.creation.box((0.01, 1.0, 1.0)) for _ in range(2)]
    for x, wall in zip((1.0, 0.0), walls, strict=True):
        wall.apply_translation([x, 0.0, 0.5])
    colors = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    for azimuth, channel in ((0.0, 0), (180.0, 1)):
        picture = draw_meshes(walls, colors, View(azimuth, 5.0, 64))
        column, row = picture.place(np.array([[0.5, 0.0, 0.5]]))[0].astype(int)
        assert np.argmax(picture.image[row, column]) == channel
        assert picture.image[row, column, channel] > 0.3


def test_a_picture_is_framed_and_white_around():
    picture = portrait(cuboid((0.3, 0.1, 0.02), 1.0), size=80)
    assert picture.image.shape == (80, 80, 3)
    assert picture.image.min() >= 0.0 and picture.image.max() <= 1.0
    np.testing.assert_array_equal(picture.image[0, 0], 1.0)
    corners = picture.place(trimesh.bounds.corners([[-0.15, -0.05, 0.0], [0.15, 0.05, 0.02]]))
    assert corners.min() > 0.0 and corners.max() < 80.0


def test_figures_of_a_cuboid():
    figures = summarize_object(cuboid((0.3, 0.2, 0.1), 1.2))
    np.testing.assert_allclose(figures.size_mm, [300.0, 200.0, 100.0])
    np.testing.assert_allclose(figures.com_mm, [0.0, 0.0, 50.0], atol=1e-5)
    np.testing.assert_allclose(figures.moments, [0.013, 0.010, 0.005], rtol=1e-5)
    np.testing.assert_allclose(np.abs(figures.axes), np.eye(3)[::-1], atol=1e-6)
    # the ellipsoid with the cuboid's tensor: a² / 5 = x² / 12
    half = np.sqrt(5.0 / 12.0) * np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(figures.semi_axes, half, rtol=1e-5)


def test_table():
    text = object_table(load_catalogue(["cube", "rock"]).values())
    head, _, cube, rock = text.splitlines()
    assert head.startswith("name  category") and "principal moments" in head
    assert cube.split()[:2] == ["cube", "Primitives"] and "2.500" in rock
    assert head.endswith("pieces off, %") and cube.endswith(" 0.0")


@pytest.mark.parametrize("suffix", [".png", ".html"])
def test_gallery_files(tmp_path, suffix):
    file = tmp_path / f"sheet{suffix}"
    gallery(load_catalogue(["cube", "rock"]), file, progress=False)
    if suffix == ".png":
        image = imread(file)
        assert image.shape[1] == 2 * 24 + 4 * 240 and 0.5 < image[..., :3].mean() < 0.99
    else:
        text = file.read_text()
        assert text.count("<figure>") == 2 and text.count("<line") == 6 and "rock" in text
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


def test_gallery_errors(tmp_path):
    objects = load_catalogue("cube")
    with pytest.raises(ValueError, match=r"ends in \.png or \.html"):
        gallery(objects, tmp_path / "sheet.jpg")
    with pytest.raises(OSError, match="expected a folder to write into, found none at"):
        gallery(objects, tmp_path / "nowhere" / "sheet.png")
    with pytest.raises(ValueError, match="none to draw"):
        gallery({}, tmp_path / "sheet.png")


@pytest.fixture
def as_it_was(monkeypatch):
    """The command line sets how JAX runs; a test must not."""
    monkeypatch.setattr("mjx_inertia.runtime.configure", lambda *_, **__: None)


def test_command_line(tmp_path, capsys, as_it_was):
    assert main(["--names", "cube", "rock"]) == 0
    out = capsys.readouterr().out
    assert "rock" in out and "2 objects" in out and "sphere" not in out
    assert main(["list", "--names", "cube"]) == 0
    assert main(["gallery", str(tmp_path / "sheet.html"), "--names", "cube"]) == 0
    assert (tmp_path / "sheet.html").exists()
    assert main(["--names", "rok"]) == 2
    assert "did you mean 'rock'" in capsys.readouterr().err
