"""What the steps of a program come to: error against CPU time, what is bias, what targets cost."""

import json
import math
from dataclasses import dataclass

import numpy

# A bias is held for one where it is this many standard errors above nothing.
CERTAIN = 3.0
# Texels along a block whose means are compared.
BLOCK = 8
# Largest standard error of a block that is compared, of its light: noise is not normal beyond.
KNOWN = 0.1


@dataclass
class Cost:
    """CPU seconds to a target; `sign` is "", "<" (the first step is better), "~" (extrapolated), "never" (bias, or an error
    that does not fall) or "?" (one step only, which tells no slope)."""

    sign: str
    cpu_s: float = math.nan


@dataclass
class Course:
    """Errors (relative RMSE) of one program on one scene, step by step."""

    cpu_s: list[float]
    rays: list[float]
    error: list[float]
    steps: list[dict]
    bias: float  # what surely remains however long it runs, as a relative RMSE; 0 where none was seen or looked for
    flux: float  # watts on the floor, of the reference's, at the last step
    is_pooled: bool
    last: numpy.ndarray

    def slope(self):
        """Exponent of error against CPU time, by least squares of logarithms; none of fewer than two steps."""
        if len(self.error) < 2:
            return math.nan
        return float(numpy.polyfit(numpy.log(self.cpu_s), numpy.log(self.error), 1)[0])

    def noise(self):
        """What of the last error is not bias."""
        return math.sqrt(self.error[-1] ** 2 - self.bias**2)

    def flux_doubt(self):
        """Standard error of `flux`, of texels that are noisy each on its own."""
        return self.noise() / math.sqrt(self.last.size)

    def cost(self, target):
        """What an error at or below `target` costs.

        Beyond what was measured, noise goes on to fall: with the square root of time where independent samples are
        averaged, else as it did. Bias stays.
        """
        for index, error in enumerate(self.error):
            if error <= target:
                return self.between(index, target)
        exponent = -0.5 if self.is_pooled else self.slope()
        if math.isnan(exponent):
            return Cost("?")
        if target <= self.bias or exponent >= 0.0:
            return Cost("never")
        wanted = math.sqrt(target**2 - self.bias**2)
        return Cost("~", self.cpu_s[-1] * (self.noise() / wanted) ** (-1.0 / exponent))

    def between(self, index, target):
        """The seconds at `target`, on a straight line of logarithms to the first step that is as good."""
        if index == 0:
            return Cost("<", self.cpu_s[0])
        before, after = self.error[index - 1], self.error[index]
        share = math.log(before / target) / math.log(before / after)
        return Cost("", self.cpu_s[index - 1] * (self.cpu_s[index] / self.cpu_s[index - 1]) ** share)


@dataclass
class Reference:
    """What a scene's map should be, and the mean square of what noise is left in it [(W/m²)²]."""

    irradiance: numpy.ndarray
    variance: float = 0.0

    @property
    def mean(self):
        """[W/m²]."""
        return self.irradiance.mean()

    @property
    def noise(self):
        """As a relative RMSE."""
        return math.sqrt(self.variance) / self.mean


def pooled(alike):
    """The reference that maps of independent noise make, [maps, rows, columns]."""
    return Reference(alike.mean(axis=0), float(alike.var(axis=0, ddof=1).mean() / len(alike)))


def relative_rmse(irradiance, reference):
    """sqrt(mean((I − R)²)) / mean(R), without the reference's noise: at least a tenth of that."""
    square = float(((irradiance - reference.irradiance) ** 2).mean()) - reference.variance
    return math.sqrt(max(square, 0.01 * reference.variance)) / reference.mean


def block_scores(found, reference):
    """How many standard errors the means over blocks of maps differ, [maps, rows, columns] each, as of a normal distribution.

    Errors are those of either side's maps among each other. Student's t becomes normal by Wallace (1959), with the degrees of
    freedom of Welch (1947). Blocks that a side knows worse than by a share of their light are left out: few rays, nothing normal.
    """
    a, b = [maps.reshape(len(maps), maps.shape[1] // BLOCK, BLOCK, -1, BLOCK).mean(axis=(2, 4)) for maps in (found, reference)]
    known = numpy.logical_and(*[each.std(axis=0, ddof=1) < KNOWN * math.sqrt(len(each)) * each.mean(axis=0) for each in (a, b)])
    a, b, n, m = a[:, known], b[:, known], len(a), len(b)
    of_a, of_b = a.var(axis=0, ddof=1) / n, b.var(axis=0, ddof=1) / m
    variance = numpy.maximum(of_a + of_b, 1e-300)
    difference = a.mean(axis=0) - b.mean(axis=0)
    freedom = variance**2 / (of_a**2 / (n - 1) + of_b**2 / (m - 1) + 1e-300)
    size = numpy.sqrt(freedom * numpy.log1p(difference**2 / variance / freedom)) * (8 * freedom + 1) / (8 * freedom + 3)
    return numpy.sign(difference) * size


def common_error(first, second, reference):
    """The error that two independent maps surely have in common, as a relative RMSE.

    Noise of one is not that of the other, so that the mean product of their errors a and b is the square of the bias. Its
    variance is the sum of ((a + b)/2 (a − b))² over the texels, by their number squared: what it is where noise is even.
    """
    a, b = ((each - reference.irradiance) / reference.mean for each in (first, second))
    doubt = math.sqrt(((0.5 * (a + b) * (a - b)) ** 2).sum()) / a.size
    return math.sqrt(max((a * b).mean() - CERTAIN * doubt, 0.0))


def course(folder, reference, is_random, is_pooled):
    """Reads the steps in a folder. Pooled ones are averaged, by samples, with all before them.

    Only random samples are independent from step to step, so that what two of them have in common is bias. Errors of lattices
    are alike, and shrink all the same. A reference with noise of its own would pass for a bias.
    """
    steps = json.loads((folder / "steps.json").read_text())
    maps = [numpy.load(folder / f"step_{number:02}.npy") for number in range(len(steps))]
    seconds, rays = ([step[name] for step in steps] for name in ("cpu_s", "rays"))
    shown = maps
    if is_pooled:
        weights = numpy.array([step["samples"] for step in steps], dtype=float)
        sums = numpy.cumsum(weights[:, None, None] * numpy.stack(maps), axis=0)
        shown = list(sums / numpy.cumsum(weights)[:, None, None])
        seconds, rays = list(numpy.cumsum(seconds)), list(numpy.cumsum(rays))
    errors = [relative_rmse(each, reference) for each in shown]
    bias = common_error(shown[-2], maps[-1], reference) if is_random and len(maps) > 1 and not reference.variance else 0.0
    # What remains cannot be more than what there is.
    bias = min(bias, errors[-1])
    return Course(seconds, rays, errors, steps, bias, float(shown[-1].mean() / reference.mean), is_pooled, shown[-1])


def read_pfm(path, noise=0.0):
    """A reference whose noise is known, of a portable float map of one channel, little-endian; rows as they are stored."""
    kind, size, scale, data = path.read_bytes().split(b"\n", 3)
    if kind != b"Pf" or float(scale) >= 0.0:
        raise ValueError(f"{path}: one channel, little-endian, is what is read here")
    width, height = map(int, size.split())
    irradiance = numpy.frombuffer(data, "<f4", width * height).reshape(height, width).astype(float)
    return Reference(irradiance, (noise * irradiance.mean()) ** 2)
