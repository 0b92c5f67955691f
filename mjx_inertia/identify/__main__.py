"""Recorded pushes in, parameters with intervals and a report out.

python -m mjx_inertia.identify push.csv --object box:0.15x0.10 --out result/
python -m mjx_inertia.identify calibrate FILES --objects TABLE --out instrument.json
python -m mjx_inertia.identify --example --out result/
"""

import argparse
import dataclasses
import html
import json
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from mjx_inertia.command import Parser, aligned, run_command
from mjx_inertia.dataset.mcube_file import McubeFileError, parse_name
from mjx_inertia.dataset.recording import MeasuredPush, read_description, read_push
from mjx_inertia.dataset.recording_file import RecordingError
from mjx_inertia.estimators import EstimateStatus
from mjx_inertia.estimators.force_driven import Instrument, load_instrument, save_instrument
from mjx_inertia.files import write_whole
from mjx_inertia.objects import (
    ObjectModel,
    export_objects,
    load_mcube_objects,
    prism,
)
from mjx_inertia.recorded.body import (
    RecordedBody,
    calibrate_instrument,
    identify_recorded,
    push_rows,
)

_EXAMPLE_OBJECT = "example.yaml"
_EXAMPLE = "example_push.csv"


def main(arguments: Sequence[str] | None = None) -> int:
    """Reads, identifies, prints a table, writes the report; returns the exit status."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words[:1] == ["calibrate"]:
        return run_command(_calibrate_parser(), _calibrate, words[1:], devices=1)
    return run_command(_parser(), _identify, words, devices=1)


def _parser() -> Parser:
    parser = Parser(
        prog="python -m mjx_inertia.identify",
        description="Inertial parameters of one object from recordings of pushes. "
        "`calibrate FILES --objects TABLE --out instrument.json` finds the constants of a sensor.",
    )
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="recordings")
    parser.add_argument(
        "--object",
        help="box:0.15x0.10, circle:0.12, a name, or a mesh, URDF, MJCF, YAML or CSV file; "
        "that of the description, or of a file of the M-dataset, if left out",
    )
    parser.add_argument("--com", help="x,y of the CoM where it is known, m, outline's frame")
    parser.add_argument("--recording", type=Path, metavar="YAML", help="description of the files")
    parser.add_argument("--instrument", type=Path, metavar="JSON", help="file of `calibrate`")
    parser.add_argument("--objects", type=Path, metavar="YAML", help="table of objects by name")
    parser.add_argument("--out", type=Path, default=Path("result"), help="folder (result)")
    parser.add_argument("--example", action="store_true", help="a recording of the package")
    return parser


def _calibrate_parser() -> Parser:
    parser = Parser(prog="python -m mjx_inertia.identify calibrate")
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="recordings")
    parser.add_argument(
        "--objects",
        type=Path,
        metavar="YAML",
        help="table of objects with mass and outline; the published ones if left out. A recording "
        "names its object in its description, a file of the M-dataset in its name",
    )
    parser.add_argument("--recording", type=Path, metavar="YAML", help="description of the files")
    parser.add_argument("--out", type=Path, default=Path("instrument.json"))
    return parser


def _identify(given: argparse.Namespace) -> None:
    files = list(given.files)
    said: dict[str, Any] = {"description": given.recording}
    obj: str | ObjectModel | None = given.object
    if given.example:
        folder = resources.files("mjx_inertia.identify")
        files = [Path(str(folder.joinpath(_EXAMPLE)))]
        said["description"] = Path(str(folder.joinpath(_EXAMPLE_OBJECT)))
    if not files:
        raise ValueError("give the files of recorded pushes, or --example")
    table = _table(given.objects)
    given.out.mkdir(parents=True, exist_ok=True)
    instrument = None if given.instrument is None else load_instrument(given.instrument)
    com = None if given.com is None else _pair(given.com)
    pushes, failures = _read(files, obj, table, com, said)
    entries = _identified(files, pushes, failures, instrument, given.out)
    write_whole(given.out / "result.json", json.dumps(entries, indent=2) + "\n")
    print(f"{given.out / 'result.json'}")


def _read(
    files: Sequence[Path],
    obj: str | ObjectModel | None,
    table: dict[str, ObjectModel],
    com: tuple[float, float] | None,
    said: dict[str, Any],
) -> tuple[dict[Path, MeasuredPush], dict[Path, str]]:
    """Pushes that could be read, and the reasons of the others."""
    pushes: dict[Path, MeasuredPush] = {}
    failures: dict[Path, str] = {}
    for file in tqdm(files, desc="reading", unit="file", disable=len(files) < 2):
        try:
            chosen = _chosen(file, obj, table, said["description"])
            pushes[file] = read_push(file, chosen, com=com, **said)
        except (ValueError, OSError) as error:
            failures[file] = error.reason if isinstance(error, RecordingError) else str(error)
    return pushes, failures


def _chosen(
    file: Path,
    obj: str | ObjectModel | None,
    table: dict[str, ObjectModel],
    description: Path | None,
) -> str | ObjectModel | None:
    """The object of a file: an entry of the table where its name is one."""
    name = obj
    if name is None:
        try:
            name = parse_name(file).shape
        except McubeFileError:
            beside = [description, file.with_suffix(".yaml"), file.parent / "recording.yaml"]
            found = next((p for p in beside if p is not None and p.is_file()), None)
            name = None if found is None else read_description(found).object
    return table.get(name, name) if isinstance(name, str) else name


def _table(path: Path | None) -> dict[str, ObjectModel]:
    return {} if path is None else load_mcube_objects(path)


def _identified(
    files: Sequence[Path],
    pushes: dict[Path, MeasuredPush],
    failures: dict[Path, str],
    instrument: Instrument | None,
    out: Path,
) -> list[dict[str, Any]]:
    """Identifies, prints and writes; one entry a file, whether it was read or not."""
    for file, reason in failures.items():
        print(f"{file}: {reason}", file=sys.stderr)
    names = ["file", "mass_kg", "mass_sd_kg", "inertia_zz_kgm2", "inertia_zz_sd_kgm2"]
    names += ["com_m", "com_sd_m", "newton_mass_kg", "newton_mass_sd_kg"]
    empty = {**dict.fromkeys(names), "status": "UNREADABLE"}
    entries = {file: {**empty, "file": str(file), "reason": failures.get(file)} for file in files}
    if not pushes:
        _write_refusals(out, failures)
        return list(entries.values())
    print("identifying; the first push takes some ten seconds to compile", file=sys.stderr)
    found = identify_recorded(list(pushes.values()), instrument=instrument)
    together = _together(found)
    for file, row in zip(pushes, push_rows(found), strict=True):
        entries[file] = {**dataclasses.asdict(row), "together": together}
    print("\n".join(_lines(found)))
    print(found.explain())
    found.report(out / "report.html")
    print(f"{out / 'report.html'}")
    if found.status == EstimateStatus.OK:
        _export(found, out)
    return list(entries.values())


def _lines(found: RecordedBody) -> list[str]:
    def cell(value: float | None, sd: float | None, scale: float) -> str:
        if value is None or sd is None:
            return "-"
        return f"{scale * value:.3f} ± {2 * scale * sd:.3f}"

    rows = [["push", "mass, kg", "I_zz, g m²", "Newton, kg", "status"]]
    for row in push_rows(found):
        rows.append(
            [
                Path(row.file).name,
                cell(row.mass_kg, row.mass_sd_kg, 1.0),
                cell(row.inertia_zz_kgm2, row.inertia_zz_sd_kgm2, 1e3),
                cell(row.newton_mass_kg, row.newton_mass_sd_kg, 1.0),
                row.status,
            ]
        )
    return aligned(rows, left=(0, 4))


def _together(found: RecordedBody) -> dict[str, Any]:
    """What all pushes together tell; null where they cannot."""
    sd = np.sqrt(np.diagonal(found.covariance))
    shown = found.determined

    def value(i: int, of: np.ndarray) -> float | None:
        return float(of[i]) if shown[i] else None

    com = bool(shown[2] and shown[3])
    return {
        "mass_kg": value(0, found.mean),
        "mass_sd_kg": value(0, sd),
        "inertia_zz_kgm2": value(1, found.mean),
        "inertia_zz_sd_kgm2": value(1, sd),
        "com_m": found.mean[2:].tolist() if com else None,
        "com_sd_m": sd[2:].tolist() if com else None,
        "pushes": sum(alone is not None for alone in found.alone),
        "status": found.status.name,
    }


def _write_refusals(out: Path, failures: dict[Path, str]) -> None:
    rows = "".join(f"<p>{html.escape(f'{file}: {why}')}</p>" for file, why in failures.items())
    page = f"<!doctype html><meta charset='utf-8'><title>No push</title><h1>No push</h1>{rows}"
    write_whole(out / "report.html", page + "\n")


def _export(found: RecordedBody, out: Path) -> None:
    """The outline as a prism with what was identified, as URDF and MJCF."""
    assert found.fit is not None
    source, (mass, inertia, x, y) = found.pushes[0].obj, (float(v) for v in found.fit.mean)
    known = {"inertia_zz": inertia} if found.determined[1] else {}
    body = prism(source.outline, source.height, mass, com=(x, y), name="identified", **known)
    export_objects({"identified": body}, out)


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"--com {text}: expected x,y in m, such as 0.005,-0.002") from None
    return x, y


def _calibrate(given: argparse.Namespace) -> None:
    table = load_mcube_objects(given.objects)
    pushes, failures = _read(given.files, None, table, None, {"description": given.recording})
    for file, reason in failures.items():
        print(f"{file}: {reason}", file=sys.stderr)
    known = {name: float(np.asarray(obj.inertial.mass)) for name, obj in table.items()}
    used = [push for push in pushes.values() if push.obj.name in known]
    if not used:
        raise ValueError(f"none of {len(given.files)} files is a push of an object of the table")
    centred = [dataclasses.replace(p, com=_com(table[p.obj.name])) for p in used]
    instrument = calibrate_instrument(centred, [known[push.obj.name] for push in used])
    save_instrument(given.out, instrument)
    print(
        f"probe mass {instrument.probe_mass:.3f} ± {2 * instrument.probe_mass_sd:.3f} kg, "
        f"deviations times {instrument.spread:.2f} ({instrument.note})"
    )
    print(f"{given.out}")


def _com(obj: ObjectModel) -> np.ndarray:
    return np.asarray(obj.inertial.com, float)[:2]


if __name__ == "__main__":
    sys.exit(main())
