"""Where the program `nephroid` of this wheel lies."""

import os
import sysconfig
from pathlib import Path


def program():
    """Path of the program. Installers put it among the scripts; Blender leaves it in the wheel's data.

    Raises FileNotFoundError where it is in none of these places.
    """
    name = "nephroid" + (sysconfig.get_config_var("EXE") or "")
    here = Path(__file__).resolve().parent.parent
    folders = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user"), here / "bin"]
    folders += here.glob("nephroid-*.data/scripts")
    for folder in folders:
        path = Path(folder) / name
        if path.is_file():
            return path
    raise FileNotFoundError(f"{name} is in none of {', '.join(map(str, folders))}; install the wheel again")
