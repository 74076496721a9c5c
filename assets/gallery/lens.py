"""The plate that writes with sunlight.

Light must be moved within the square so that its density becomes that of the picture: if light of x goes to x + grad f, then
det(1 + D2 f) target(x + grad f) = 1, a Monge-Ampere equation. It is solved by a sequence of Poisson equations (Benamou,
Froese and Oberman, 2010) whose solutions are sums of cosines. The height of the glass is proportional to f.
"""
import numpy as np

from kit import join, sheet

CELLS, ROUNDS, QUADS = 64, 60, 48
LINE, CONTRAST = 0.013, 12.0


def butterfly():
    """Density of the picture, with mean 1: the curve of T. H. Fay (1989) as a bright line."""
    angle = np.linspace(0, 2 * np.pi, 900, endpoint=False)
    radius = 0.115 * (np.exp(np.sin(angle)) - 2 * np.cos(4 * angle))
    curve = np.stack([0.5 + radius * np.cos(angle), 0.42 + radius * np.sin(angle)], -1)
    middle = (np.arange(CELLS) + 0.5) / CELLS
    place = np.stack(np.meshgrid(middle, middle), -1)
    nearest = np.min(((place[:, :, None] - curve)**2).sum(-1), -1)
    picture = 1 + (CONTRAST - 1) * np.exp(-0.5 * nearest / LINE**2)
    return picture / picture.mean()


def potential(target):
    """f, as coefficients of cosines."""
    wave, middle = np.arange(CELLS), (np.arange(CELLS) + 0.5) / CELLS
    cosines = np.cos(np.pi * wave[:, None] * middle)
    weight = np.where(wave == 0, 1, 2) / CELLS
    # Of the finite differences below, not of the continuous operator.
    eigenvalue = (2 - 2 * np.cos(np.pi * wave / CELLS)) * CELLS**2
    eigenvalue = eigenvalue[:, None] + eigenvalue
    eigenvalue[0, 0] = np.inf
    factors = np.zeros((CELLS, CELLS))
    for _ in range(ROUNDS):
        f = np.pad(cosines.T @ factors @ cosines, 1, mode='edge')
        xx = (f[1:-1, 2:] - 2 * f[1:-1, 1:-1] + f[1:-1, :-2]) * CELLS**2
        yy = (f[2:, 1:-1] - 2 * f[1:-1, 1:-1] + f[:-2, 1:-1]) * CELLS**2
        xy = (f[2:, 2:] - f[2:, :-2] - f[:-2, 2:] + f[:-2, :-2]) * 0.25 * CELLS**2
        x = middle + (f[1:-1, 2:] - f[1:-1, :-2]) * CELLS / 2
        y = middle[:, None] + (f[2:, 1:-1] - f[:-2, 1:-1]) * CELLS / 2
        wanted = np.sqrt((1 + xx)**2 + (1 + yy)**2 + 2 * xy**2 + 2 / look_up(target, x, y)) - 2
        factors = -(cosines @ wanted @ cosines.T) * weight[:, None] * weight / eigenvalue
    return factors


def look_up(grid, x, y):
    x, y = (np.clip(at * CELLS - 0.5, 0, CELLS - 1) for at in (x, y))
    column, row = (np.minimum(at.astype(int), CELLS - 2) for at in (x, y))
    fx, fy = x - column, y - row
    low, high = (grid[row + k, column] * (1 - fx) + grid[row + k, column + 1] * fx for k in (0, 1))
    return low * (1 - fy) + high * fy


def relief(centre, right, up, forward, side, thick, distance, index):
    """Closed mesh of the plate: a square with its flat back at `centre`; the picture forms at `distance`."""
    # A thin prism turns light by (index - 1) times its slope.
    height = side**2 / (distance * (index - 1))
    factors = potential(butterfly())
    at = np.linspace(0, 1, QUADS + 1)
    frequency = np.pi * np.arange(CELLS)[:, None]
    cosines, slopes = np.cos(frequency * at), -frequency * np.sin(frequency * at)
    # Rows are v, columns u.
    relief_m = thick + height * (cosines.T @ factors @ cosines)
    slope_u, slope_v = (height / side * (a.T @ factors @ b) for a, b in ((cosines, slopes), (slopes, cosines)))
    u, v = np.meshgrid(at - 0.5, at - 0.5)
    back = centre + side * (u[..., None] * right + v[..., None] * up)
    front = back + relief_m[..., None] * forward
    parts = [sheet(front, forward - slope_u[..., None] * right - slope_v[..., None] * up)]
    for edge, outward in ((np.s_[0], -up), (np.s_[-1], up), (np.s_[:, 0], -right), (np.s_[:, -1], right)):
        wall = np.stack([back[edge], front[edge]])
        parts.append(sheet(wall, np.broadcast_to(outward, wall.shape)))
        # The flat back in as few triangles as share its border.
        fan = np.stack([back[edge], np.broadcast_to(centre, back[edge].shape)])
        parts.append(sheet(fan, np.broadcast_to(-forward, fan.shape)))
    return join(*parts)
