"""Frozen results: ``python -m tests.command.golden.make [NAME ...]`` writes ``NAME.json`` here.

Each file has flat keys with a number or a list of numbers. A change on purpose changes the file in
the same commit, whose message says why.
"""

import io
import json
import sys
from contextlib import redirect_stdout
from math import isfinite
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np

from alignscores import (
    closest_pair_quartile,
    compare,
    evaluate,
    pas,
    ras,
    ras_angle,
    tas,
    tas_distance,
)
from alignscores.cli import main as command
from baselines import ate, dre, dte, maa, rotation_statistics
from experiments.config import load_sweep
from experiments.sweep import run_sweeps
from tests.files import EXAMPLES, FILES

from .inputs import N_SCENES, SEQUENCES, scene, write_made_runs, write_real_runs

FOLDER = Path(__file__).parent
ALIGNMENTS = {"similarity": 1, "rigid": 4, "yaw": 4, "none": 4}  # every so many scenes of each
METRICS = """
    auc@30:vggt auc@30:mapanything auc@30:da3 rra@5:vggt rra@5:mapanything rra@5:da3
    rta@5:vggt rta@5:mapanything rta@5:da3 auc@5:colmap auc@5:colmap-imc
    recall@10cm,5deg:hloc recall@10cm,5deg:hloc-sim3 median:hloc
    median:hloc-sim3 median:hloc:rotation median:hloc-sim3:rotation ate:rmse:sim3 ate:mean:se3
    ate:median:scale ate:max:none ate:std:sim3 are:rmse:sim3 are:mean:none
    rpe@1f rpe@5f:rotation rpe@1m rpe@1m:all rpe@1m:all-reference rpe@1m:rotation rpe@1m:distance
    rpe@2m:mean:sim3 roterr transerr:cami2v transerr:cami2v-abs transerr:cameractrl cammc:cami2v
    cammc:cami2v-abs cammc:cameractrl rpg@2m rpg@2m:median:sim3 rpg@2m:rotation
""".split()  # noqa: SIM905
KITTI = ["kitti", "kitti:rotation", "rpg@100m", "rpg@100m:rotation", "rpe@100m"]
TIMED = ["ate:rmse:sim3"]
EXPERIMENTS = """
    outliers collinear trajectory_length rotations combined maa_vs_pas_outliers maa_vs_pas_length
    maa_vs_pas_collinear
""".split()  # noqa: SIM905


def formats(folder):
    """The JSON of the command for every format in ``tests/data``."""
    results = {}
    for format_name, files in FILES.items():
        with redirect_stdout(io.StringIO()) as printed:
            command([format_name, *(str(EXAMPLES / file) for file in files), "--json"])
        results[format_name] = json.loads(printed.getvalue())["results"]
    return flat(results)


def scenes(folder):
    """Scores, and the distance and angle of half a score: a list over the scenes for each."""
    results = {}
    for alignment, step in ALIGNMENTS.items():
        rows = [_scores(*scene(index, alignment), alignment) for index in range(0, N_SCENES, step)]
        results[alignment] = {key: [row[key] for row in rows] for key in rows[0]}
    return flat(results)


def _scores(gt, est, alignment):
    positions, rotations = (gt[:, :3, 3], est[:, :3, 3]), (gt[:, :3, :3], est[:, :3, :3])
    angles = ras(*rotations, alignment=alignment)
    results = {
        "unit": closest_pair_quartile(positions[0]),
        "ras": float(angles),
        "median angle": median(angles.errors),
        "angle": ras_angle(*rotations, alignment=alignment),
    }
    for registration in ("pcr99", "refined"):
        options = {"registration": registration, "alignment": alignment}
        result = tas(*positions, **options)
        results |= {
            f"{registration} tas": float(result),
            f"{registration} pas": float(pas(gt, est, **options)),
            f"{registration} median error": median(result.errors),
            f"{registration} distance": tas_distance(*positions, **options),
        }
    return results


def protocols(folder):
    """Metrics of other projects, on the scenes that are 20 and 50 cameras."""
    results = {}
    for index in (2, 3, 12, 13, 17, 18, 32, 33, 43, 48):
        files = folder / "gt.npy", folder / "est.npy"
        for file, poses in zip(files, scene(index), strict=True):
            np.save(file, poses)
        result = evaluate(*files, format="arrays", metrics=METRICS)
        results[f"scene {index}"] = result.to_dict()["metrics"]
    return flat(results)


def baselines(folder):
    """The paper's baselines, on the scenes where all cameras are estimated."""
    results = {}
    for index in (*range(30), *range(45, 60)):
        gt, est = scene(index)
        rotations = gt[:, :3, :3], est[:, :3, :3]
        row = {
            "ate": ate(gt[:, :3, 3], est[:, :3, 3]),
            "dte": dte(gt, est),
            "dre": dre(*rotations),
            "maa": maa(gt, est),
            **rotation_statistics(*rotations),
        }
        for key, value in row.items():
            results.setdefault(key, []).append(value)
    return flat(results)


def trials(folder):
    """The tables of the eight experiments at one trial a cell: a list for each column."""
    results = {}
    for name in EXPERIMENTS:
        table = run_sweeps([load_sweep([f"experiment={name}", "trials=1"])])
        for column in table.columns[table.columns.get_loc("n_cameras") :]:
            results[f"{name}/{column}"] = table[column].astype(float).tolist()
    return flat(results)


def made_runs(folder):
    """`evaluate` and `compare` on runs with time stamps that are drawn."""
    write_made_runs(folder)
    results = {}
    for system in ("frames", "keyframes", "late"):
        files = folder / "hall/groundtruth.txt", folder / f"hall/{system}/0.txt"
        results[system] = evaluate(*files, format="tum", metrics=TIMED).to_dict()
        results[f"{system}, pcr99"] = evaluate(
            *files, format="tum", registration="pcr99", repeat=3
        ).to_dict()
        results[f"{system}, t_offset"] = evaluate(*files, format="tum", t_offset="auto").to_dict()
    return flat(results) | _compared(folder)


def real_runs(folder):
    """`evaluate` and `compare` on pieces of real runs; their origin: ``shared/real``."""
    write_real_runs(folder)
    results = {}
    for estimate in ("ORB", "ORB_kf_mono"):
        files = folder / "fr2_desk/groundtruth.txt", folder / f"fr2_desk/{estimate}.txt"
        results[f"fr2_desk {estimate}"] = evaluate(*files, format="tum", metrics=TIMED).to_dict()
    for estimate in ("ORB", "SPTAM"):
        files = folder / "KITTI_00/gt.txt", folder / f"KITTI_00/{estimate}.txt"
        results[f"KITTI_00 {estimate}"] = evaluate(*files, format="kitti", metrics=KITTI).to_dict()
    for sequence in SEQUENCES:
        for system in ("vislam_ba", "vislam_rp", "vio_mono"):
            files = folder / sequence / "groundtruth.txt", folder / sequence / system / "0.txt"
            results[f"{sequence} {system}"] = evaluate(
                *files, format="tum", metrics=TIMED
            ).to_dict()
            results[f"{sequence} {system}, yaw"] = evaluate(
                *files, format="tum", alignment="yaw"
            ).to_dict()
    return flat(results) | _compared(folder)


def _compared(folder):
    patterns = "{sequence}/groundtruth.txt", "{sequence}/{system}/{run}.txt"
    compared = compare(*(f"{folder}/{pattern}" for pattern in patterns), format="tum").to_dict()
    return flat({key: compared[key] for key in ("summary", "pairs")}, "compare")


RESULTS = {
    make.__name__: make
    for make in (formats, scenes, protocols, baselines, trials, made_runs, real_runs)
}


def flat(value, key=""):
    """Return the numbers in a JSON value by the path to each, to 10 significant digits.

    Lists of numbers stay together. An undefined number is None.
    """
    return dict(_flat(value, key))


def _flat(value, key):
    if isinstance(value, dict):
        for name, part in value.items():
            if name == "deficits":  # follow from the errors; evaluation/test_deficits.py has them
                continue
            yield from _flat(part, f"{key}/{name}" if key else str(name))
    elif isinstance(value, list) and value and all(map(_is_number, value)):
        yield key, [_rounded(part) for part in value]
    elif isinstance(value, list):
        for index, part in enumerate(value):
            yield from _flat(part, f"{key}/{index}")
    elif _is_number(value):
        yield key, _rounded(value)


def _is_number(value):
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def _rounded(value):
    if value is None or not isfinite(value):
        return None
    return value if isinstance(value, int) else float(f"{value:.10g}")


def main(names):
    """Write the files that are named, by default all."""
    for name in names or RESULTS:
        with TemporaryDirectory() as folder:
            results = RESULTS[name](Path(folder))
        lines = (f"{json.dumps(key)}: {json.dumps(value)}" for key, value in results.items())
        (FOLDER / f"{name}.json").write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
