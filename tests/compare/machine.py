"""What the figures were measured with: programs, their versions, the machine."""

import ctypes
import os
import platform
from importlib import metadata

import nephroid


def heading(given):
    """One line of versions, machine and budget."""
    programs = [
        nephroid.run(given.nephroid, "--version").strip().capitalize(),
        f"Mitsuba {metadata.version('mitsuba')} (Dr.Jit {metadata.version('drjit')}, {llvm()})",
    ]
    programs += [] if given.glass else [f"Blender {metadata.version('bpy')}"]
    machine = f"{processor()}, {os.cpu_count()} cores"
    return f"{', '.join(programs)}; {machine}; {given.budget:g} CPU seconds for each program and scene"


def processor():
    """The processor's name."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            found = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        found = platform.processor() or platform.machine()
    return found.replace("(R)", "")


def llvm():
    """The version of the library that Dr.Jit compiles with."""
    path = os.environ.get("DRJIT_LIBLLVM_PATH")
    if not path:
        return "no LLVM"
    numbers = [ctypes.c_uint() for _ in range(3)]
    ctypes.CDLL(path).LLVMGetVersion(*map(ctypes.byref, numbers))
    return "LLVM " + ".".join(str(number.value) for number in numbers)
