"""The page: tables in Markdown and CSV, and what they say in words. No sentence has a result but those that are found here."""

import math
from statistics import median

from figures import CERTAIN

TARGETS = [0.05, 0.02, 0.01]
OURS = "auto"
NEPHROID = ["photon", "auto", "splat"]
LEGEND = """*slope* is the exponent of error against CPU time, by least squares of logarithms through all steps. Seconds are
interpolated between steps; `<` is the first step, which is better already; `~` goes on from the last one, with the square
root of time where independent samples are averaged, else as measured; `never` is a bias. What two independent runs have in
common, by three standard errors, counts as bias; `ptracer`, whose noise hides it, has that of aimed rays that start as its
own do."""
GLASS_LEGEND = """*true/estimated* is of the last bake. *ratio* is the photons' seconds over those of aimed rays. Where a scene has
no map of its own, the reference is the mean of all of the aimed rays' maps that differ by their seeds alone, or of brute force
where light is dispersed; its noise is taken from all errors."""
BLOCK_LEGEND = """Means over 8 × 8 texels of maps that differ by their seeds alone: blocks that are more than three standard errors apart,
both sides' noise included, beside how many a normal distribution allows, and the root mean square of all, in standard errors (1 is chance). Noise of few
rays has longer tails: photons against themselves show by how much."""
# Of the normal distribution, beyond three standard errors.
BEYOND = 0.0027
# Watts that are off by more than this are told.
FLUX_BOUND = 0.02


def percent(value):
    """A share as per cent, of two digits below ten."""
    return f"{100 * value:,.0f} %" if value >= 0.1 else f"{100 * value:.2g} %"


def number(value):
    """Seconds, rays or a ratio to two digits, large ones as powers of ten."""
    if value >= 1e6:
        mantissa, exponent = f"{value:.1e}".split("e")
        return f"{mantissa}e{int(exponent)}"
    return f"{float(f'{value:.2g}'):,.0f}" if value >= 9.95 else f"{value:#.2g}"


def cost(found):
    """A cost as it stands in the table."""
    return found.sign if math.isnan(found.cpu_s) else found.sign + number(found.cpu_s)


def slope(course):
    """The exponent of error against time."""
    return "" if math.isnan(course.slope()) else f"{round(course.slope(), 2) + 0.0:.2f}".replace("-", "−")


def line(scene, program, course):
    """One program on one scene, for who waits."""
    costs = ", ".join(f"{percent(target)}: {cost(course.cost(target))}" for target in TARGETS)
    return (f"{scene}, {program.name}: {percent(course.error[-1])} after {number(course.cpu_s[-1])} CPU s, "
            f"watts {course.flux:.3f} of the reference's, seconds to {costs}")


def csv(courses, names):
    """Every step."""
    rows = ["scene,program,step,rays,cpu_s,relative_rmse,estimated,bias,flux_ratio,slope,cpu_s_to_5,cpu_s_to_2,cpu_s_to_1,left_out_cpu_s"]
    for (scene, key), course in courses.items():
        costs = ",".join(cost(course.cost(target)).replace(",", "") for target in TARGETS)
        for step, (rays, seconds, error) in enumerate(zip(course.rays, course.cpu_s, course.error)):
            rows.append(f'{scene},"{names[key]}",{step},{rays:.0f},{seconds:.4f},{error:.6g},'
                        f"{course.steps[step].get('estimated') or math.nan:.4g},{course.bias:.4g},"
                        f"{course.flux:.5f},{course.slope():.3f},{costs},{course.steps[0]['before_s']:.3f}")
    return "\n".join(rows) + "\n"


def markdown(courses, names, left_out, heading):
    """Tables and sentences."""
    scenes = list(dict.fromkeys(scene for scene, _ in courses))
    parts = [heading + ":", table(courses, names), LEGEND]
    parts += [sentence for scene in scenes for sentence in verdicts(scene, of_scene(courses, scene), names)]
    ours = {(scene, names[key]): course for (scene, key), course in courses.items() if key in NEPHROID and key != "splat"}
    parts += [asked(ours), worse_than_asked(ours)] if ours else []
    parts += [stuck(courses, names), watts(courses, names), not_counted(courses, names)]
    parts += [f"{name} is left out: {reason}." for name, reason in left_out.items()]
    return "\n\n".join(part for part in parts if part) + "\n"


def glass_markdown(courses, names, left_out, heading, references, scores):
    """The page of scenes of glass: references by scene, and scores of blocks by scene and pair of programs."""
    parts = [heading + ":", glass_table(courses, references), GLASS_LEGEND, block_table(scores, names), BLOCK_LEGEND, table(courses, names), LEGEND]
    parts += [stuck(courses, names), watts(courses, names), not_counted(courses, names)]
    parts += [f"{name} is left out: {reason}." for name, reason in left_out.items()]
    return "\n\n".join(part for part in parts if part) + "\n"


def glass_table(courses, references):
    """CPU seconds to the coarsest target, and whether Nephroid knows its error."""
    target = percent(TARGETS[0])
    rows = [f"| scene | photon, CPU s to {target} | auto, to {target} | aimed rays, to {target} | ratio "
            "| photon: true/estimated | auto: true/estimated | noise of the reference |", "|---" * 8 + "|"]
    ratios, doubts = [], {"photon": [], "auto": []}
    for scene in dict.fromkeys(scene for scene, _ in courses):
        programs = of_scene(courses, scene)
        costs = {key: programs[key].cost(TARGETS[0]) for key in ["photon", "auto", "aimed"] if key in programs}
        cells = [cost(costs[key]) if key in costs else "" for key in ["photon", "auto", "aimed"]]
        ratio = costs["photon"].cpu_s / costs["aimed"].cpu_s if {"photon", "aimed"} <= costs.keys() else math.nan
        ratios += [] if math.isnan(ratio) else [ratio]
        cells.append("" if math.isnan(ratio) else number(ratio))
        for key, found in doubts.items():
            estimated = programs[key].steps[-1]["estimated"] if key in programs else None
            found += [programs[key].error[-1] / estimated] if estimated else []
            cells.append(f"{percent(programs[key].error[-1])} / {percent(estimated)} = {found[-1]:.2f}" if estimated else "")
        rows.append(f"| `{scene}` | {' | '.join(cells)} | {percent(references[scene].noise)} |")
    middle = [f"{median(found):.2f}" if found else "" for found in (ratios, *doubts.values())]
    return "\n".join([*rows, f"| median | | | | {' | '.join(middle)} | |"])


def block_table(scores, names):
    """Blocks that differ by more than three standard errors."""
    pairs = list(dict.fromkeys(pair for _, pair in scores))
    heads = [f"{names[first]} against {names[second] if first != second else 'itself'}" for first, second in pairs]
    rows = ["| scene | " + " | ".join(heads) + " |", "|---" * (1 + len(pairs)) + "|"]
    for scene in dict.fromkeys(scene for scene, _ in scores):
        cells = []
        for pair in pairs:
            found = scores.get((scene, pair))
            if found is None or not len(found):
                cells.append("")
                continue
            beyond, size = sum(abs(found) > CERTAIN), math.sqrt((found**2).mean())
            cells.append(f"{beyond} of {len(found)} ({BEYOND * len(found):.1f}); {size:.2f}")
        rows.append(f"| `{scene}` | " + " | ".join(cells) + " |")
    return "\n".join(rows)


def of_scene(courses, scene):
    """Programs on one scene."""
    return {key: course for (name, key), course in courses.items() if name == scene}


def table(courses, names):
    """The table: one row for each scene and program."""
    rows = ["| scene | program | error | after CPU s | slope | CPU s to 5 % | to 2 % | to 1 % |"]
    rows += ["|---|---|---|---|---|---|---|---|"]
    before = None
    for (scene, key), course in courses.items():
        shown = "" if scene == before else f"`{scene}`"
        cells = [shown, names[key], percent(course.error[-1]), number(course.cpu_s[-1]), slope(course)]
        cells += [cost(course.cost(target)) for target in TARGETS]
        rows.append(f"| {' | '.join(cells)} |")
        before = scene
    return "\n".join(rows)


def bakes(ours):
    """Nephroid's bakes to the table's targets: (scene, program, step, true error)."""
    for (scene, name), course in ours.items():
        yield from ((scene, name, step, error) for step, error in zip(course.steps, course.error) if step["samples"] in TARGETS)


def asked(ours):
    """What Nephroid was asked for, what it thought it had, and what it had."""
    rows = ["| scene | program | `--max-error` | estimated | true | rays | CPU s |", "|---|---|---|---|---|---|---|"]
    rows += [f"| `{scene}` | {name} | {percent(step['samples'])} | {percent(step['estimated'])} | {percent(error)} | "
             f"{step['rays']:,} | {number(step['cpu_s'])} |" for scene, name, step, error in bakes(ours)]
    return "\n".join(rows)


def worse_than_asked(ours):
    """Where Nephroid promised too much."""
    said = [f"{percent(step['samples'])} on `{scene}` ({name})" for scene, name, step, error in bakes(ours) if error > step["samples"]]
    return f"The true error is above what was asked for in {len(said)} of {len(list(bakes(ours)))} bakes" + (
        f": {listed(said)}." if said else ".")


def listed(words):
    """Words with commas and a last "and"."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def verdicts(scene, programs, names):
    """Who is first at each target on a scene, and by how much; and who has the least error when the budget is spent."""
    ours = programs.get(OURS)
    others = {key: course for key, course in programs.items() if key not in NEPHROID}
    if ours is None or not others:
        return
    by_target = [against(ours.cost(target), {names[key]: course.cost(target) for key, course in others.items()})
                 for target in TARGETS]
    said = [words.format(listed(found)) + f" to {listed([percent(target) for target in targets])}"
            for words, found, targets in grouped(by_target)]
    said += [quicker_splats(ours, programs["splat"])] if "splat" in programs else []
    least = min(programs, key=lambda key: programs[key].error[-1])
    said.append(f"the least error within the budget is {percent(programs[least].error[-1])}, by {names[least]}")
    yield f"`{scene}`: {'; '.join(part for part in said if part)}."


def against(mine, rivals):
    """One target, Nephroid's bundles and the best of the other programs: a sentence, and the figure that it has a place for."""
    rivals = {name: found for name, found in rivals.items() if not math.isnan(found.cpu_s)}
    if math.isnan(mine.cpu_s):
        return "bundles do not come{}" if mine.sign == "never" else "it is not known when bundles come{}", ""
    if not rivals:
        return "no other program comes{}", ""
    name, best = min(rivals.items(), key=lambda item: item[1].cpu_s)
    doubt = {"<": "more than ", "~": "about "}.get(mine.sign, "about " if best.sign == "~" else "")
    times = number(best.cpu_s / mine.cpu_s)
    if best.sign == "<":
        return f"{name} takes {{}} times the CPU time of bundles", f"at most {times}"
    if mine.cpu_s <= best.cpu_s:
        return f"the best of the others, {name}, takes {{}} times the CPU time of bundles", doubt + times
    return f"**{name} is quicker**: {{}} of the CPU time of bundles", percent(best.cpu_s / mine.cpu_s)


def grouped(by_target):
    """Neighbouring targets of which the same is to be said: (sentence, figures, targets)."""
    groups = []
    for target, (words, figure) in zip(TARGETS, by_target):
        if groups and groups[-1][0] == words:
            groups[-1][1].append(figure)
            groups[-1][2].append(target)
        else:
            groups.append((words, [figure], [target]))
    return [(words, figures if any(figures) else [""], targets) for words, figures, targets in groups]


def quicker_splats(ours, splats):
    """Targets that Nephroid's own splats reach before its bundles."""
    said = []
    for target in TARGETS:
        mine, other = ours.cost(target), splats.cost(target)
        if not math.isnan(other.cpu_s) and not mine.cpu_s <= other.cpu_s:
            said.append(f"{percent(target)} ({cost(other)} CPU s against {cost(mine)})")
    return f"Nephroid's own splats are quicker than its bundles to {listed(said)}" if said else ""


def stuck(courses, names):
    """Who has a bias above the finest target."""
    said = [f"{names[key]} on `{scene}` ({percent(course.bias)} or more)"
            for (scene, key), course in courses.items() if course.bias > min(TARGETS)]
    if not said:
        return ""
    return f"Stuck with a bias that no number of samples takes away: {listed(said)}."


def watts(courses, names):
    """Whose floor does not get the reference's watts, by more than noise."""
    said = [f"{names[key]} on `{scene}` {abs(100 * course.flux):.0f} %"
            for (scene, key), course in courses.items()
            if abs(course.flux - 1.0) > max(FLUX_BOUND, CERTAIN * course.flux_doubt())]
    rest = f"within {percent(FLUX_BOUND)} of the reference's, or within {CERTAIN:g} standard errors"
    return f"Watts on the floor are {rest}, but for {listed(said)}." if said else f"Watts on every floor are {rest}."


def not_counted(courses, names):
    """CPU seconds before the clock runs, which favour who needs most of them."""
    most = {}
    for (_, key), course in courses.items():
        most[key] = max(most.get(key, 0.0), course.steps[0]["before_s"])
    said = [f"{names[key]} {number(seconds)}" for key, seconds in sorted(most.items(), key=lambda item: -item[1])]
    return f"Not counted are starting, loading, hierarchies and compiling, at most these CPU seconds on a scene: {listed(said)}."
