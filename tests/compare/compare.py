"""Nephroid beside other programs: error of the floor's caustic against CPU seconds, on the same meshes and maps.

Writes DIR/compare.csv (every step), DIR/compare.md (the page), DIR/SCENE_PROGRAM.png (the last maps beside the reference) and
DIR/steps (every map).
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import figures
import machine
import nephroid
import page
import pictures

HERE = Path(__file__).parent
REFERENCES = HERE.parent.parent / "assets" / "reference"
SCENES = {"ring": "S1", "ball": "S2", "pool": "S3"}
SIDE = 256


@dataclass
class Program:
    """A row of the table: its script (none is Nephroid itself) and the last of its arguments. Maps of random samples may be
    pooled where none of them is stratified."""

    key: str
    name: str
    script: str
    last: list[str]
    is_pooled: bool = False
    needs_llvm: bool = False
    starts_as: str = ""  # another program whose rays start as its rays do, and leave the same bias


PROGRAMS = [
    Program("wavefront", "Nephroid, wavefront", "", ["wavefront"]),
    Program("splat", "Nephroid, splat", "", ["splat"]),
    Program("aimed", "aimed rays on Mitsuba's intersector", "aimed.py", ["line"], needs_llvm=True),
    Program("aimed_beside", "aimed rays, started by Mitsuba's `spawn_ray`", "aimed.py", ["beside"], needs_llvm=True),
    Program("ptracer_llvm", "Mitsuba `ptracer`, llvm", "ptracer.py", ["llvm_ad_rgb"], True, True, "aimed_beside"),
    Program("ptracer_scalar", "Mitsuba `ptracer`, scalar", "ptracer.py", ["scalar_rgb"], True, starts_as="aimed_beside"),
    Program("cycles_paths", "Cycles bake, path traced", "blender.py", ["paths"], True),
    Program("cycles_mnee", "Cycles bake, MNEE", "blender.py", ["mnee"], True),
]


def arguments():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nephroid", type=Path, required=True)
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--budget", type=float, default=60.0, metavar="SECONDS", help="CPU seconds, per program and scene")
    parser.add_argument("--scenes", type=Path, metavar="DIR", help="S1.glb, S2.glb, S3.glb in place of the built-in scenes")
    parser.add_argument("--only", help="names of programs, with commas", default=",".join(each.key for each in PROGRAMS))
    parser.add_argument("--page", action="store_true", help="measures nothing: the page of what a run left in DIR/steps")
    return parser.parse_args()


def measure(program, given, scene, folder):
    """Lets a program spend its budget; raises RuntimeError with the last it said where it fails."""
    if program.needs_llvm and not os.environ.get("DRJIT_LIBLLVM_PATH"):
        raise RuntimeError("libLLVM 16 or newer was not found")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if not program.script:
        nephroid.take(given.nephroid, scene, folder, given.budget, SIDE, *program.last)
        return
    command = [sys.executable, HERE / program.script, scene, folder, given.budget, SIDE, *program.last]
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise RuntimeError(" ".join(done.stdout.split()[-40:]))


def scene_file(given, name, folder):
    """The meshes that every program reads."""
    if given.scenes:
        return given.scenes / f"{SCENES[name]}.glb"
    return nephroid.export_scene(given.nephroid, name, folder)


def measured(given, wanted):
    """Every program on every scene: courses by (scene, program), and why some are left out, by program."""
    courses, left_out = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for name, reference_name in SCENES.items():
            scene = None if given.page else scene_file(given, name, Path(folder))
            reference = figures.read_pfm(REFERENCES / f"{reference_name}.pfm")
            for program in wanted:
                steps = given.output / "steps" / name / program.key
                try:
                    if not given.page:
                        measure(program, given, scene, steps)
                    found = figures.course(steps, reference, bool(program.script), program.is_pooled)
                except (RuntimeError, OSError) as error:
                    left_out[program.name] = str(error)
                    print(f"compare: {program.name} on {name} is LEFT OUT: {error}", file=sys.stderr, flush=True)
                    continue
                if (name, program.starts_as) in courses:
                    found.bias = min(max(found.bias, courses[name, program.starts_as].bias), found.error[-1])
                courses[name, program.key] = found
                pictures.write(given.output / f"{name}_{program.key}.png", found.last, reference)
                print(page.line(name, program, found), flush=True)
    return courses, left_out


def main():
    given = arguments()
    given.output.mkdir(parents=True, exist_ok=True)
    names = {each.key: each.name for each in PROGRAMS}
    heading = given.output / "heading.txt"
    if not given.page:
        heading.write_text(machine.heading(given))
    courses, left_out = measured(given, [each for each in PROGRAMS if each.key in given.only.split(",")])
    (given.output / "compare.csv").write_text(page.csv(courses, names))
    text = page.markdown(courses, names, left_out, heading.read_text())
    (given.output / "compare.md").write_text(text)
    print(text)


main()
