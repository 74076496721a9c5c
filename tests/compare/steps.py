"""Runs of one program, each with more samples than the last, until a budget of CPU seconds is spent."""

import json
import resource
from pathlib import Path

import numpy

# A last run that would be shorter than this share of the budget is left out.
LEAST_SHARE = 0.1
# Seeds of maps that are all made alike start here.
ALIKE_SEED = 1000


def cpu_s():
    """CPU seconds of all threads of this process."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def take(folder, budget_s, first, trace, *, pooled, build_s=0.0, rays_per_sample=1, alike=0):
    """Writes `step_NN.npy` (maps of irradiance [W/m²]) and `steps.json`: their CPU seconds and rays, and the seconds before.

    `trace(samples, seed)` makes a map, independent of all others; `build_s` is what each call takes before it samples.
    Pooled maps share the budget, since all of them are averaged; others have it each for itself.
    `alike` maps that differ by their seeds alone, `alike.npy`, take the budget once more, together.
    """
    folder = Path(folder)
    steps, samples, spent_s, before_s = [], first, 0.0, cpu_s()
    while samples >= 1:
        start_s = cpu_s()
        irradiance = trace(samples, len(steps))
        taken_s = max(cpu_s() - start_s - build_s, 1e-3)
        numpy.save(folder / f"step_{len(steps):02}.npy", irradiance)
        steps.append({"cpu_s": taken_s, "samples": samples, "rays": samples * rays_per_sample, "before_s": before_s})
        (folder / "steps.json").write_text(json.dumps(steps))
        spent_s = spent_s + taken_s if pooled else taken_s
        left_s = budget_s - spent_s if pooled else budget_s
        if budget_s - spent_s < LEAST_SHARE * budget_s:
            break
        samples = min(2 * samples, int(left_s * samples / taken_s))
    if alike:
        each = max(int(steps[-1]["samples"] * budget_s / steps[-1]["cpu_s"] / alike), 1)
        numpy.save(folder / "alike.npy", [trace(each, ALIKE_SEED + number) for number in range(alike)])
