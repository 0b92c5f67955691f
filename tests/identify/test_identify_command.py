"""`python -m mjx_inertia.identify`: what it writes, finds and refuses."""

import json

import numpy as np
import pytest
from recordings import DESCRIPTION, PROBE, box, streams, write_csv

import mjx_inertia as mi
from mjx_inertia.estimators import EstimateStatus
from mjx_inertia.estimators.force_driven import Instrument, load_instrument, save_instrument
from mjx_inertia.identify.__main__ import main
from mjx_inertia.recorded.body import calibrate_instrument

TRUTH = float(box().inertial.mass)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three pushes of one box, and their description."""
    folder = tmp_path_factory.mktemp("recordings")
    (folder / "recording.yaml").write_text(DESCRIPTION)
    for number, offset in enumerate((0.0, 0.02, -0.03)):
        signals = streams(box(), (-0.075, offset), seed=number)
        write_csv(folder / f"push{number}.csv", *signals)
    return folder


@pytest.fixture(scope="module")
def pushes(folder):
    return [mi.read_push(folder / f"push{number}.csv", com=(0.0, 0.0)) for number in range(3)]


@pytest.fixture(scope="module")
def found(pushes):
    return mi.identify(pushes)


def test_the_mass_comes_back_within_its_interval(found):
    assert found.status == EstimateStatus.OK
    low, high = found.interval(0.99)[0]
    assert low < TRUTH < high
    assert np.sqrt(found.covariance[0, 0]) < 0.15 * TRUTH
    for mean, covariance in found.alone:
        assert abs(mean[0] - TRUTH) < 3.0 * np.sqrt(covariance[0, 0])


def test_several_pushes_are_sharper_than_each(found):
    joint = np.sqrt(found.covariance[0, 0])
    assert all(joint < np.sqrt(covariance[0, 0]) for _, covariance in found.alone)


def test_a_known_com_is_that_from_the_first_contact(found):
    assert found.mean[2:] == pytest.approx([0.075, 0.0], abs=1e-3)
    assert "CoM x: 75" in found.explain()


def test_the_probe_counts_as_mass_where_nobody_states_it(pushes, found):
    light = mi.identify(pushes, instrument=Instrument())
    assert light.mean[0] - found.mean[0] == pytest.approx(PROBE, rel=0.5)
    assert "counted as mass of the object" in light.explain()


def test_the_next_push_is_on_the_outline_and_leads_inward(found):
    planned = found.next_push()
    half = np.array([0.075, 0.05])
    assert np.abs(np.abs(planned.contact_point) - half).min() < 1e-9
    assert planned.direction @ planned.contact_point < 0.0
    assert planned.mass_sd < np.sqrt(found.covariance[0, 0]) / found.mean[0]


def test_calibration_finds_the_probe(pushes):
    instrument = calibrate_instrument(pushes, [TRUTH] * 3)
    assert instrument.probe_mass == pytest.approx(PROBE, abs=0.2)
    with pytest.raises(ValueError, match="masses"):
        calibrate_instrument(pushes, [TRUTH])


def test_the_instrument_survives_its_file(tmp_path):
    instrument = Instrument(0.2, 0.01, 1.3, "test")
    save_instrument(tmp_path / "i.json", instrument)
    assert load_instrument(tmp_path / "i.json") == instrument
    for text in ("", "[]", '{"mass": 1}', '{"probe_mass": -1}', '{"spread": 0.5}'):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(ValueError, match=r"bad\.json"):
            load_instrument(tmp_path / "bad.json")


def test_the_command_writes_report_results_and_the_object(folder, tmp_path, capsys):
    files = [str(folder / f"push{number}.csv") for number in range(3)]
    (folder / "broken.csv").write_text("time,force_x\n1,2\n")
    out = tmp_path / "result"
    assert main([*files, str(folder / "broken.csv"), "--com", "0,0", "--out", str(out)]) == 0
    entries = json.loads((out / "result.json").read_text())
    assert [entry["file"] for entry in entries] == [*files, str(folder / "broken.csv")]
    good, bad = entries[0], entries[3]
    assert good["mass_kg"] == pytest.approx(TRUTH, abs=3.0 * good["mass_sd_kg"])
    assert good["status"] == "OK"
    assert good["together"]["pushes"] == 3
    assert bad["mass_kg"] is None
    assert "no column force_y" in bad["reason"]
    report = (out / "report.html").read_text()
    assert "Signals of push0.csv" in report
    assert "http" not in report.replace("http://www.w3.org", "")
    screen = capsys.readouterr()
    assert "Mass: " in screen.out
    assert "no column force_y" in screen.err
    body = mi.import_object(out / "identified" / "identified.urdf")
    assert float(body.inertial.mass) == pytest.approx(entries[0]["together"]["mass_kg"], rel=1e-6)


def test_calibrate_and_identify_on_the_command_line(folder, tmp_path):
    table = tmp_path / "objects.yaml"
    table.write_text(
        "objects:\n  box:\n    outline: [[0.075, 0.05], [-0.075, 0.05], [-0.075, -0.05], "
        f"[0.075, -0.05]]\n    mass: {TRUTH}\n    inertia_zz: 0.004875\n    height: 0.06\n"
    )
    (tmp_path / "recording.yaml").write_text(DESCRIPTION.replace("box:0.15x0.10x0.06", "box"))
    files = [str(folder / f"push{number}.csv") for number in range(3)]
    said = ["--recording", str(tmp_path / "recording.yaml"), "--objects", str(table)]
    instrument = tmp_path / "instrument.json"
    assert main(["calibrate", *files, *said, "--out", str(instrument)]) == 0
    assert load_instrument(instrument).probe_mass > 0.0


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ([], "give the files"),
        (["x.csv", "--com", "1"], "--com 1: expected x,y"),
        (["x.csv", "--instrument", "none.json"], "none.json"),
        (["--nonsense"], "--nonsense"),
    ],
)
def test_what_cannot_be_is_one_line(tmp_path, capsys, words, text):
    try:
        code = main([*words, "--out", str(tmp_path / "out")])
    except SystemExit as stopped:
        code = stopped.code
    assert code == 2
    error = capsys.readouterr().err.strip()
    assert text in error
    assert len(error.splitlines()) == 1


def test_no_file_that_can_be_read_still_gives_an_entry_each(tmp_path):
    assert main([str(tmp_path / "none.csv"), "--object", "hex", "--out", str(tmp_path)]) == 0
    (entry,) = json.loads((tmp_path / "result.json").read_text())
    assert entry["status"] == "UNREADABLE"
    assert (tmp_path / "report.html").is_file()


def test_real_and_simulated_pushes_do_not_mix(pushes):
    simulated = mi.simulate_push(box(), (-0.075, 0.0))
    with pytest.raises(ValueError, match="one kind a call"):
        mi.identify([pushes[0], simulated])
