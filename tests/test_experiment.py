"""Experiments as programs: what they are told, what they refuse, what a run folder holds."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest
import yaml
from omegaconf import OmegaConf

from mjx_inertia.dataset import Source
from mjx_inertia.experiment import options_from
from mjx_inertia.settings import CONFIGS, compose, from_config
from mjx_inertia.sweep import SweepResult

SCRIPTS = {path.stem: path for path in (CONFIGS.parent / "experiments").glob("*.py")}
PREFIXES = {"identify": "identify", "novel_objects": "novel"}
SCRIPT = '''"""A small one."""

from dataclasses import dataclass

from mjx_inertia.experiment import experiment


@dataclass(frozen=True)
class Options:
    pushes: int = 20
    parts: tuple[str, ...] = ("check",)


@experiment(Options)
def main(options, folder):
    if options.pushes == 0:
        raise ValueError("no pushes")
    (folder / "figure.svg").write_text("drawn")
    return {"pushes": options.pushes, "parts": options.parts}


if __name__ == "__main__":
    main()
'''
COMPOSE = "\nfrom mjx_inertia.settings import compose\n\n\n@dataclass"


@dataclass(frozen=True)
class Options:
    pushes: int = 20
    spread: float = 0.05
    name: str = "cube"
    root: str | None = None
    speed: float | Literal["all"] = 0.04
    parts: tuple[Literal["check", "rate"], ...] = ("check", "rate")
    seen: tuple[str, ...] = ("mug",)


def test_what_is_told_replaces_a_default():
    assert options_from(Options, {}) == Options()
    told = {"pushes": 7, "spread": 1, "root": "a b", "parts": "rate", "seen": ["dog", "mug"]}
    expected = Options(7, 1.0, root="a b", parts=("rate",), seen=("dog", "mug"))
    assert options_from(Options, told) == expected
    assert options_from(Options, {"name": 7, "root": None}) == Options(name="7")
    assert [options_from(Options, {"speed": v}).speed for v in ("all", 1)] == ["all", 1.0]


def test_unknown_names():
    with pytest.raises(ValueError, match=r"^novel\.push: no such option; there are \['pushes', "):
        options_from(Options, {"push": 7}, "novel")


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        *(("pushes", v, "a whole number") for v in ("", "x", -1, 7.0, True, None, [7])),
        *(("spread", v, "a finite number") for v in ("", "x", float("nan"), float("inf"), True)),
        *(("name", v, "text that is not empty") for v in ("", None, True, ["cube"])),
        ("root", "", "text that is not empty or null"),
        ("speed", "none", "a finite number or one of ['all']"),
        ("parts", [], "a list that is not empty"),
        *(("parts", v, "some of ['check', 'rate']") for v in ("", "x", ["check", "x"], None)),
        *(("seen", v, "text that is not empty") for v in ("", ["mug", ""], [["mug"]])),
    ],
)
def test_bad_values(name, value, expected):
    with pytest.raises(ValueError) as error:
        options_from(Options, {name: value})
    assert str(error.value).startswith(f"{name}=")
    assert f": expected {expected}" in str(error.value)
    assert "\n" not in str(error.value)


def test_every_script_has_a_configuration():
    assert set(SCRIPTS) == {path.stem for path in (CONFIGS / "experiment").glob("*.yaml")}


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(SCRIPTS))
def test_configuration_of_every_script(name, run_script, capsys):
    code, namespace = run_script(SCRIPTS[name], "--cfg", "job")
    assert code == 0
    config = yaml.safe_load(capsys.readouterr().out)
    if "Options" in namespace:
        prefix = PREFIXES.get(name)
        told = config[prefix] if prefix else config
        assert options_from(namespace["Options"], told) == namespace["Options"]()
    if "dataset" in config:
        config["dataset"]["root"] = "x"
        settings = compose([f"experiment={name}", "++dataset.root=x"])
        assert from_config(OmegaConf.create(config), PREFIXES.values()) == settings
    for argument in ("no_such_option=1", "no_such_option", "+no_such_option=1"):
        code, _ = run_script(SCRIPTS[name], argument)
        assert isinstance(code, str) and code.startswith("error: ") and "\n" not in code
        assert "no_such_option" in code


@pytest.mark.parametrize("place", ["dataset", "estimator", "features", "estimator.mlp"])
def test_unknown_names_within_the_main_job(place, run_script):
    code, _ = run_script(SCRIPTS["large_dataset"], f"+{place}.no_such_option=1")
    assert isinstance(code, str) and code.startswith("error: ") and "\n" not in code
    assert "no_such_option" in code


@pytest.fixture
def small(tmp_path) -> Path:
    """A script that computes nothing, with the name and the configuration file of another."""
    path = tmp_path / "bound.py"
    path.write_text(SCRIPT)
    return path


def test_run_folder(small, run_script, capsys, tmp_path):
    code, _ = run_script(small, "pushes=7", "parts=[a,b]")
    assert code == 0
    line = capsys.readouterr().out.splitlines()[-1]
    assert json.loads(line) == {"pushes": 7, "parts": ["a", "b"]}
    folder = tmp_path / "outputs/experiments/bound"
    assert (folder / "result.json").read_text() == line + "\n"
    assert (folder / "figure.svg").is_file()
    config = yaml.safe_load((folder / ".hydra/config.yaml").read_text())
    assert config == {"pushes": 7, "parts": ["a", "b"]}


def test_run_folder_of_the_user_and_sweeps(small, run_script, tmp_path):
    assert run_script(small, "parts=a", "hydra.run.dir=here")[0] == 0
    assert json.loads((tmp_path / "here/result.json").read_text())["parts"] == ["a"]
    assert run_script(small, "-m", "pushes=1,2", "hydra.sweep.dir=many")[0] == 0
    results = [json.loads((tmp_path / f"many/{i}/result.json").read_text()) for i in range(2)]
    assert [r["pushes"] for r in results] == [1, 2]
    assert not (tmp_path / "outputs").exists()


def test_a_failing_job_leaves_the_others_of_a_sweep_to_run(small, run_script, capsys, tmp_path):
    code, _ = run_script(small, "-m", "pushes=0,1", "hydra.sweep.dir=many")
    assert code == 1
    error = capsys.readouterr().err
    assert "error: no pushes (where: " in error and "Traceback" not in error
    assert (tmp_path / "many/0/error.txt").is_file()
    assert json.loads((tmp_path / "many/1/result.json").read_text())["pushes"] == 1


@pytest.mark.parametrize(
    ("failure", "code", "sentence"),
    [
        ("KeyboardInterrupt", 130, "interrupted: what is stored stays"),
        ("OSError(28, 'No space left on device')", None, "error: [Errno 28] No space left"),
    ],
)
def test_an_interrupt_and_a_full_disk_are_one_line(
    small, run_script, capsys, failure, code, sentence
):
    small.write_text(SCRIPT.replace("    if options", f"    raise {failure}\n    if options"))
    found, _ = run_script(small)
    told = capsys.readouterr().err if code else str(found)
    assert told.startswith(sentence) and "Traceback" not in told
    assert len(told.strip().splitlines()) == 1
    if code:
        assert found == code


def test_the_report_needs_no_copy_of_the_configuration(small, run_script, monkeypatch, tmp_path):
    found = SweepResult(Source("none", lambda: iter(()), None, None, ()), {}, (), {}, None)
    monkeypatch.setattr("mjx_inertia.experiment.run_sweep", lambda settings: found)
    monkeypatch.setattr("mjx_inertia.runtime.configure", lambda *_, **__: None)
    texts = []
    write = lambda folder, result, text, sections=(): texts.append(text)  # noqa: E731
    monkeypatch.setattr("mjx_inertia.experiment.write_outputs", write)
    code, _ = run_script(SCRIPTS["large_dataset"], "hydra.output_subdir=null")
    assert code == 0
    assert yaml.safe_load(texts[0])["dataset"]["name"] == "full"


def test_a_program_may_compose_further_configurations(small, run_script):
    told = SCRIPT.replace("    if options", "    compose(['estimator=mean'])\n    if options")
    small.write_text(told.replace("\n\n\n@dataclass", COMPOSE))
    assert run_script(small)[0] == 0


@pytest.mark.long
def test_help_tells_what_the_script_does(small, run_script, capsys):
    assert run_script(small, "--help")[0] == 0
    text = capsys.readouterr().out
    assert text.startswith("A small one.") and "pushes: 20" in text


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        ("pushes=-1", "error: pushes=-1: expected a whole number that is not negative"),
        ("parts=[]", "error: parts=[]: expected a list that is not empty"),
        ("parts=a,b", "error: Ambiguous value for argument 'parts=a,b'; 1. To use it as a list"),
        ("pushes", "error: 'pushes': expected name=value"),
        ("7", "error: '7': expected name=value"),
        ("", "error: '': expected name=value"),
        ("pushes=0", "error: no pushes"),
        ("experiment=none", "error: In 'bound': Could not find 'experiment/none'"),
    ],
)
def test_what_is_wrong_ends_in_one_sentence(small, run_script, capsys, argument, expected):
    code, _ = run_script(small, argument)
    assert code.startswith(expected) and "\n" not in code
    assert "Traceback" not in capsys.readouterr().err


def test_traceback_where_it_is_asked_for(small, run_script, monkeypatch):
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
    with pytest.raises(ValueError, match="no pushes"):
        run_script(small, "pushes=0")
