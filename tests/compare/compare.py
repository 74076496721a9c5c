"""Nephroid beside other programs: error of the floor's caustic against CPU seconds, on the same meshes and maps.

Writes DIR/compare.csv (every step), DIR/compare.md (the page), DIR/SCENE_PROGRAM.png (the last maps beside the reference) and
DIR/steps (every map). DIR/scenes holds their meshes.
"""

import argparse
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy

import figures
import glass
import machine
import nephroid
import page
import pictures

HERE = Path(__file__).parent
REFERENCES = HERE.parent.parent / "assets" / "reference"
SCENES = {"ring": "S1", "ball": "S2", "pool": "S3"}
SIDE = 256
# Specular surfaces on a path, as many as photons have by default.
DEPTH = 256
# Maps of a scene of glass that differ by their seeds alone.
ALIKE = {"photon": 8, "aimed": 8, "brute": 6}
# Relative noise of reference maps where it is known.
KNOWN = {"wine": 0.0167, "tumbler": 0.0139, "lens": 0.0101}


@dataclass
class SceneFile:
    """Meshes that every program reads, and their reference where it is known before."""

    file: Path
    reference: figures.Reference | None


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
    Program("photon", "Nephroid, photon", "", ["photon"]),
    Program("auto", "Nephroid, auto", "", ["auto"]),
    Program("splat", "Nephroid, splat", "", ["splat"]),
    Program("aimed", "aimed rays on Mitsuba's intersector", "aimed.py", ["line"], needs_llvm=True),
    Program("aimed_beside", "aimed rays, started by Mitsuba's `spawn_ray`", "aimed.py", ["beside"], needs_llvm=True),
    Program("ptracer_llvm", "Mitsuba `ptracer`, llvm", "ptracer.py", ["llvm_ad_rgb"], True, True, "aimed_beside"),
    Program("ptracer_scalar", "Mitsuba `ptracer`, scalar", "ptracer.py", ["scalar_rgb"], True, starts_as="aimed_beside"),
    Program("cycles_paths", "Cycles bake, path traced", "blender.py", ["paths"], True),
    Program("cycles_mnee", "Cycles bake, MNEE", "blender.py", ["mnee"], True),
]
BRUTE_FORCE = Program("brute", "brute force", "", [])
GLASS = [each for each in PROGRAMS if each.key in ["photon", "auto", "aimed"]] + [BRUTE_FORCE]
# Programs whose blocks are compared; of one with itself, the even maps with the odd ones.
PAIRS = [("photon", "photon"), ("photon", "aimed"), ("photon", "brute"), ("aimed", "brute")]


def arguments():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nephroid", type=Path, required=True)
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--budget", type=float, default=60.0, metavar="SECONDS", help="CPU seconds, per program and scene")
    parser.add_argument("--glass", action="store_true", help="scenes of glass in place of the reference scenes")
    parser.add_argument("--scenes", type=Path, metavar="DIR", help="S1.glb, S2.glb, S3.glb in place of the built-in scenes; of "
                        "glass: NAME.glb with NAME.pfm beside the others")
    parser.add_argument("--only", metavar="NAMES", help="programs or scenes, with commas", type=lambda names: names.split(","))
    parser.add_argument("--page", action="store_true", help="measures nothing: the page of what a run left in DIR/steps")
    return parser.parse_args()


def measure(program, given, scene, folder):
    """Lets a program spend its budget; raises RuntimeError with the last it said where it fails."""
    if program.needs_llvm and not os.environ.get("DRJIT_LIBLLVM_PATH"):
        raise RuntimeError("libLLVM 16 or newer was not found")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    alike = ALIKE.get(program.key, 0) if given.glass else 0
    if program is BRUTE_FORCE:
        nephroid.brute_force(given.nephroid, scene, folder, given.budget, SIDE, alike)
        return
    if not program.script:
        nephroid.take(given.nephroid, scene, folder, given.budget, SIDE, *program.last, alike)
        return
    aimed = [DEPTH, alike] if program.script == "aimed.py" else []
    command = [sys.executable, HERE / program.script, scene.file, folder, given.budget, SIDE, *aimed, *program.last]
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise RuntimeError(" ".join(done.stdout.split()[-40:]))


def scene_files(given, folder):
    """What is compared, by name."""
    if not given.glass:
        return {name: SceneFile(
            given.scenes / f"{key}.glb" if given.scenes else nephroid.export_scene(given.nephroid, name, folder),
            figures.read_pfm(REFERENCES / f"{key}.pfm"),
        ) for name, key in SCENES.items()}
    found = {}
    for file in sorted(given.scenes.glob("*.glb")) if given.scenes else []:
        reference = figures.read_pfm(file.with_suffix(".pfm"), KNOWN.get(file.stem, 0.0))
        found[file.stem] = SceneFile(file, reference)
    return found | {name: SceneFile(glass.write(name, folder), None) for name in glass.SCENES}


def chosen(items, only):
    """Of names and what they mean, those that are asked for; all where none of them is."""
    wanted = {name: item for name, item in items.items() if name in (only or [])}
    return wanted or items


def measured(given, wanted, scenes):
    """Every program on every scene: courses by (scene, program), references by scene, scores of blocks by (scene, pair), and why
    some are left out."""
    courses, references, scores, left_out = {}, {}, {}, {}
    for name, scene in scenes.items():
        folder, done = given.output / "steps" / name, []

        # A program that fails is left out with its reason, and the others go on.
        for program in wanted:
            try:
                if not given.page:
                    measure(program, given, scene, folder / program.key)
                done.append(program)
            except (RuntimeError, OSError) as error:
                left_out[f"{program.name} on `{name}`"] = str(error)
                print(f"compare: {program.name} on {name} is LEFT OUT: {error}", file=sys.stderr, flush=True)

        # Maps that differ by their seeds alone tell, block by block, whether two programs agree within their noise.
        alike = {each.key: numpy.load(file) for each in done if (file := folder / each.key / "alike.npy").exists()}
        for first, second in PAIRS:
            if first in alike and second in alike:
                sides = (alike[first], alike[second]) if first != second else (alike[first][::2], alike[first][1::2])
                scores[name, (first, second)] = figures.block_scores(*sides)

        # Where no reference is known, the mean of such maps is one, with their noise.
        reference = scene.reference or next((figures.pooled(alike[key]) for key in ["aimed", "brute"] if key in alike), None)

        # A course has at least the bias of the program whose rays start as its own do, up to the error at its end.
        for program in done:
            references[name] = reference
            if reference is None or not (folder / program.key / "steps.json").exists():
                continue
            found = figures.course(folder / program.key, reference, bool(program.script), program.is_pooled)
            if (name, program.starts_as) in courses:
                found.bias = min(max(found.bias, courses[name, program.starts_as].bias), found.error[-1])
            courses[name, program.key] = found
            pictures.write(given.output / f"{name}_{program.key}.png", found.last, reference.irradiance)
            print(page.line(name, program, found), flush=True)
    return courses, references, scores, left_out


def main():
    given = arguments()
    given.output.mkdir(parents=True, exist_ok=True)
    programs = GLASS if given.glass else PROGRAMS
    names = {each.key: each.name for each in programs}
    heading = given.output / "heading.txt"
    if not given.page:
        heading.write_text(machine.heading(given))
    (given.output / "scenes").mkdir(exist_ok=True)
    scenes = chosen(scene_files(given, given.output / "scenes"), given.only)
    wanted = list(chosen({each.key: each for each in programs}, given.only).values())
    courses, references, scores, left_out = measured(given, wanted, scenes)
    (given.output / "compare.csv").write_text(page.csv(courses, names))
    if given.glass:
        text = page.glass_markdown(courses, names, left_out, heading.read_text(), references, scores)
    else:
        text = page.markdown(courses, names, left_out, heading.read_text())
    (given.output / "compare.md").write_text(text)
    print(text)


main()
