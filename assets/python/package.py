"""Builds what is handed out, for the system that it runs on: wheel, source archive, tarball, Blender extension.

Usage: python package.py OUTPUT_FOLDER [MATURIN-ARGUMENTS...]   (needs cargo and `pip install maturin`)

Each holds the licences of all crates in the program. Further arguments go to `maturin build`, such as
`--target x86_64-apple-darwin`, or `--compatibility manylinux_2_28 --zig` for older systems.
"""

import json
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# Where maturin looks for it; git ignores it.
LICENCES = HERE / "LICENSES.txt"
# Starts of their names in the folders of crates.
LICENCE_FILES = ("license", "licence", "copying", "notice", "unlicense", "copyright", "ofl", "ufl")

# Platforms of wheels as Blender calls them.
BLENDER_PLATFORMS = {
    ("linux", "x86_64"): "linux-x64", ("macosx", "arm64"): "macos-arm64", ("macosx", "x86_64"): "macos-x64",
    ("win", "amd64"): "windows-x64", ("win", "arm64"): "windows-arm64"}


def cargo(*command):
    return subprocess.run(["cargo", *command], cwd=ROOT, check=True, capture_output=True, text=True).stdout


def licences(target):
    """Our own licences, then those of all crates that are linked, each text once, after the crates that it covers."""
    told = cargo("tree", "--locked", "--edges", "normal", "--prefix", "none", "--format", "{p}", *target)
    linked = {tuple(line.split()[:2]) for line in told.splitlines() if line}
    texts, bare = {}, []
    for package in json.loads(cargo("metadata", "--locked", "--format-version", "1"))["packages"]:
        if (package["name"], f"v{package['version']}") not in linked or package["name"] == "nephroid":
            continue
        name = f"{package['name']} {package['version']} ({package['license'] or 'see its licence file'})"
        paths = sorted(Path(package["manifest_path"]).parent.rglob("*"))
        files = [path for path in paths if path.name.lower().startswith(LICENCE_FILES) and path.is_file()]
        for file in files:
            texts.setdefault(file.read_text(errors="replace").strip(), []).append(f"{name}: {file.name}")
        if not files:
            bare.append(f"{name}, {package['repository'] or 'no repository'}")
    parts = ["Nephroid: MIT or Apache-2.0, at your choice. The crates that it contains follow."]
    parts += [(ROOT / name).read_text() for name in ("LICENSE-MIT", "LICENSE-APACHE")]
    parts += ["\n".join(names) + "\n\n" + text for text, names in texts.items()]
    parts.append("These crates bring no text of their own; the licences they name stand above.\n\n" + "\n".join(bare))
    return ("\n\n" + "=" * 80 + "\n\n").join(parts) + "\n"


def extension(wheel, output):
    """The Blender extension, with the program inside as a wheel."""
    _, version, *_, platform = wheel.stem.split("-")
    system = next(name for (kind, machine), name in BLENDER_PLATFORMS.items()
                  if kind in platform and platform.endswith(machine))
    path = output / f"nephroid-blender-{version}-{system}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted((ROOT / "assets" / "blender").glob("*.py")):
            archive.write(file, file.name)
        manifest = (ROOT / "assets" / "blender" / "blender_manifest.toml").read_text()
        extra = f'platforms = ["{system}"]\nwheels = ["./wheels/{wheel.name}"]\n\n[permissions]'
        archive.writestr("blender_manifest.toml", manifest.replace("[permissions]", extra))
        archive.write(LICENCES, LICENCES.name)
        archive.write(wheel, f"wheels/{wheel.name}", zipfile.ZIP_STORED)
    return path


def tarball(wheel, output):
    """The bare program from a wheel, beside licences and README."""
    path = output / f"{wheel.stem.replace('-py3-none', '')}.tar.gz"
    with zipfile.ZipFile(wheel) as archive, tarfile.open(path, "w:gz") as packed:
        program = next(info for info in archive.infolist() if ".data/scripts/nephroid" in info.filename)
        entry = tarfile.TarInfo(f"nephroid/{Path(program.filename).name}")
        entry.size, entry.mode = program.file_size, 0o755
        packed.addfile(entry, archive.open(program))
        for file in [LICENCES, ROOT / "README.md"]:
            packed.add(file, f"nephroid/{file.name}")
    return path


def main():
    output = Path(sys.argv[1]).resolve()
    output.mkdir(parents=True, exist_ok=True)
    arguments = sys.argv[2:]
    place = arguments.index("--target") if "--target" in arguments else len(arguments)
    LICENCES.write_text(licences(arguments[place:place + 2]))
    for wheel in output.glob("nephroid-*.whl"):
        wheel.unlink()
    for command in ["sdist"], ["build", "--release", *arguments]:
        subprocess.run([sys.executable, "-m", "maturin", *command, "--out", output], cwd=HERE, check=True)
    wheel = next(output.glob("nephroid-*.whl"))
    made = [wheel, *output.glob("nephroid-*.tar.gz"), tarball(wheel, output), extension(wheel, output)]
    for file in dict.fromkeys(made):
        print(f"{file.stat().st_size / 1e6:6.1f} MB  {file}")


main()
