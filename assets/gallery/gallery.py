"""Writes gallery.glb, the scene `builtin:gallery`: a bath house by the sea in low sun. Lengths in metres, y up, z towards
the first camera.

    python3 gallery.py
"""
import os
import re
import textwrap

import numpy as np

from kit import File, box, facets, fractal, join, lathe, mesh, moved, noise, rect, ring, rotation, sheet, unit
from lens import relief

A = np.array
UP = A([0.0, 1.0, 0.0])

# The sun stands 31 degrees high: lower, the glasses throw their light too far; higher, the pool leaves the wall dark.
SUN = unit([0.76, -0.50, 0.36])
SUN_W_PER_M2, SUN_COLOUR = 10.2, [1.0, 0.80, 0.52]
SKY_W_PER_M2, SKY_COLOUR = 5.0, [0.96, 1.0, 1.09]

ROOM_X, ROOM_Z, HEIGHT = (-1.7, 2.0), (-4.2, 2.8), 3.4
WALL, BAND = 0.35, 0.09
POOL_X, POOL_Z, RIM, WATER, BOTTOM = (-0.9, 1.55), (-3.6, -0.55), 0.46, 0.40, -0.90
TABLE_X, TABLE_Z, TABLE = (-0.85, 0.85), (0.10, 1.15), 0.75
CLOTH, CLOTH_SIZE = TABLE + 0.0015, (1.00, 0.74)

file = File()


# ---- materials

def tinted(value, colour):
    return value[..., None] * A(colour)


def wood(n=256):
    """Planed boards: rings that run along, with pores."""
    rings = noise((n, n), (7, 1), 51, 3) + 0.35 * noise((n, n), (3, 2), 52, 3)
    grain = 0.5 + 0.5 * np.sin(34 * rings) + 0.35 * noise((n, n), (120, 3), 53, 2)
    return tinted(1.06 - 0.30 * np.clip(grain, 0, 1), (0.47, 0.29, 0.18))


def plaster(colour, bloom, seed, n=256):
    """Coats that dried unevenly: a pale bloom, broad sweeps, and strokes of the brush both ways."""
    veil = np.clip(0.4 + 0.9 * noise((n, n), (4, 4), seed, 6, 0.6), 0, 1)
    sweep = sum(depth * noise((n, n), cells, seed, 3) for depth, cells in ((0.04, (3, 3)), (0.02, (12, 10)), (0.015, (40, 40))))
    return (tinted(1 - veil, colour) + tinted(veil, bloom)) * (1 + sweep[..., None])


def fresco(n=512):
    """The back wall from floor to ceiling: a red dado, a frieze above the arches, and lines that part them."""
    y, out = HEIGHT * (1 - (np.arange(n)[:, None] + 0.5) / n), plaster((0.90, 0.60, 0.42), (0.95, 0.77, 0.61), 12, n)
    bands = ((0.40, 0.40, (0.46, 0.15, 0.10)), (0.83, 0.02, (0.90, 0.84, 0.72)), (2.37, 0.16, (0.17, 0.27, 0.40)),
             (2.19, 0.02, (0.90, 0.84, 0.72)), (2.55, 0.02, (0.90, 0.84, 0.72)))
    for at, half, colour in bands:
        out = np.where((np.abs(y - at) < half)[..., None], A(colour) * out / out.mean((0, 1)), out)
    return out


def marble(n=448):
    """Dark green, with white veins that cross."""
    cloud = noise((n, n), (3, 3), 1, 6, 0.55)
    out = tinted(0.19 + 0.07 * noise((n, n), (5, 5), 2, 6, 0.6), (0.84, 1.0, 1.02))
    for width, depth, seed in ((0.016, 0.60, 5), (0.05, 0.16, 6), (0.010, 0.50, 7)):
        line = np.exp(-np.abs(noise((n, n), (2, 2), seed, 6, 0.55) + 0.25 * cloud) / width)
        patchy = np.clip(0.4 + 1.1 * noise((n, n), (3, 3), seed + 20, 3), 0, 1)
        out += tinted(depth * line * patchy, (1.0, 0.98, 0.93))
    return out


def tiles(n, per_side, light, dark, joint, gap, seed):
    y, x = np.mgrid[0:n, 0:n] / n * per_side
    row, column = y.astype(int), x.astype(int)
    tone = np.random.default_rng(seed).uniform(0, 1, (per_side, per_side))[row, column]
    tone = np.clip(tone + 0.3 * noise((n, n), (8, 8), seed + 1, 4), 0, 1)[..., None]
    edge = np.minimum.reduce([y - row, 1 - y + row, x - column, 1 - x + column])
    return np.where((edge < gap)[..., None], A(joint), A(light) * tone + A(dark) * (1 - tone))


def linen(long, wide, texel=0.0006):
    """A whole cloth, thread by thread: a border of stripes, a stitched hem, and creases where it lay folded."""
    random, s, t = np.random.default_rng(61), np.arange(0, long, texel)[:, None], np.arange(0, wide, texel)
    edge = np.minimum(np.minimum(s, long - s), np.minimum(t, wide - t))
    weave = 0.016 * np.sin(s * np.pi / 2 / texel) * np.sin(t * np.pi / 2 / texel)
    out = 0.62 + weave + random.normal(0, 0.011, s.shape) + random.normal(0, 0.011, t.shape) + 0.03 * noise(edge.shape, (5, 4), 62, 3)
    for fold in ((s - long / 3) / 0.005, (s - long * 2 / 3) / 0.005, (wide / 2 - t) / 0.005):
        out += 0.11 * fold * np.exp(-0.5 * fold**2)
    out += 0.03 * (edge < 0.014) - 0.14 * (np.abs(edge - 0.014) < 0.0012)
    dyed = sum(np.abs(edge - at) < half for at, half in ((0.040, 0.003), (0.053, 0.007), (0.066, 0.003)))
    # In steps, so that a palette holds them.
    return tinted(np.round(out, 2), (0.985, 1, 1.02)) * (1 - dyed[..., None] * A([0.80, 0.66, 0.44]))


# Letters as strokes of points x, y (hexadecimal): the line of writing is at 3, low letters reach 8 and high ones c.
LETTERS = '''a0708484643,4606033345 b0c03,060848430306 c474808034344 d4c43,464808034345 e0646,464808034344 f3b3c1c13,0838
    g48400001,464808034345 h0c03,0608484643 i0803,0b j28200001,2b k0c03,0548,1643 l0c03 m0803,0608383633,3638686663 n0803,0608484643
    o280803434828 p0800,060848430306 q4840,464808034345 r0803,06083837 s4748080645430304 t1a133334,0838 u08034345,4843 v0823,2348
    w0823,2338,3853,5368 x0843,4803 y0823,481000 z0848,4803,0343 A033b,3b63,1656 L0b03,0343 S5a5b0b0857530304 T0b6b,3b33
    W0b23,234b,4b63,638b .03,04,13,14 ,1301 ;1301,17'''
HEADING, TEXT = 'What the Sun Wrote', '''
The sun writes without a hand. Lend it a glass of wine, and it draws a red leaf on the cloth; lend it a ring, and it draws a heart
whose point turns to the lamp wherever you set it down.
Light does nothing for show. At each wall of glass it takes the way that is soonest done, and where many such ways lie side by side
the cloth is bright. The line you see is a crowd.
Water is a lens that cannot keep still. A wave gathers its handful of day, carries it a little and lets it fall, so that the floor
of a pool is a page that is never the same twice.
Send a white ray through a wedge of heavy glass; red leaves it almost straight, violet gives way the most, and all the rest stand
in a row between. A colour is a way of being turned aside.
Shadows are not empty. Look into one as long as it takes for tea to cool, and you will find the room in it, folded small and faint.
Stand where the light is sharpest and look back along it. Two suns meet there, and with one step to the side both are gone.
'''


def letter(strokes, unit):
    """Ink of one letter, drawn by a broad nib whose edge stands at 30 degrees; upright strokes get serifs."""
    p = []
    for stroke in strokes:
        q = A([[int(x, 16), int(y, 16)] for x, y in zip(stroke[::2], stroke[1::2])], float)
        serifs = [q[0] + A([[-0.8, -0.4], [0, 0]]), q[1] + A([[-0.8, 0], [0.8, 0]])] if len(q) == 2 and stroke[0] == stroke[2] else []
        for line in [q, *serifs]:
            # Cutting its corners rounds a stroke and makes its points many.
            for _ in range(5):
                cuts = np.stack([0.75 * line[:-1] + 0.25 * line[1:], 0.25 * line[:-1] + 0.75 * line[1:]], 1)
                line = np.vstack([line[:1], cuts.reshape(-1, 2), line[-1:]])
            p += line.tolist()
    p = A(p)
    y, x = np.mgrid[0:int(14 * unit), 0:int(np.ceil((p[:, 0].max() + 1.9) * unit))] / unit
    dx, dy = x[..., None] - 0.5 - p[:, 0], 12.6 - y[..., None] - p[:, 1]
    nib = np.hypot((0.87 * dx + 0.5 * dy) / 0.60, (0.87 * dy - 0.5 * dx) / 0.28).min(-1)
    return np.clip(0.5 + 0.4 * unit * (1 - nib), 0, 1)


def page(first, heading='', width=736, height=1088):
    """A heading and paragraphs, from the first given on, in justified lines."""
    ink, measure, row = np.zeros((height, width)), 0.73 * width, int(0.10 * height)
    small, large = ({s[0]: letter(s[1:].split(','), unit) for s in LETTERS.split()} for unit in (1.85, 3.0))
    words = lambda text, font: [np.hstack([font[c] for c in word]) for word in text.split()]
    blank, paragraphs = np.zeros((25, 24)), re.split(r'\n(?=[A-Z])', TEXT.strip())
    lines = [(words(heading, large), False), ([blank], False)] if heading else []
    for text in (paragraphs[first:] + paragraphs) * 2:
        wrapped = textwrap.wrap(text, 52)
        lines += [([blank] * (k == 0) + words(line, small), k < len(wrapped) - 1) for k, line in enumerate(wrapped)]
    for line, full in lines[:33]:
        at, gap = 0.14 * width, (measure - sum(w.shape[1] for w in line)) / (len(line) - 1) if full else 7
        for word in line:
            ink[row:row + len(word), int(at):int(at) + word.shape[1]] += word
            at += word.shape[1] + gap
        row += len(line[0]) + 1
    return tinted(1 - 0.05 * np.round(16 * np.clip(ink, 0, 1)), (0.84, 0.80, 0.72))


def wave(amplitude_m, wavelength_m, degrees, phase_rad):
    direction = [np.cos(np.radians(degrees)), np.sin(np.radians(degrees))]
    return dict(amplitude_m=amplitude_m, wavelength_m=wavelength_m, direction=direction, phase_rad=phase_rad)


def add_materials():
    file.material('plaster', texture=plaster((0.82, 0.68, 0.50), (0.86, 0.74, 0.57), 11), metres=2.4)
    file.material('terracotta', texture=fresco(), metres=HEIGHT)
    file.material('stone', texture=plaster((0.61, 0.56, 0.48), (0.66, 0.61, 0.53), 13), metres=0.9)
    file.material('ashlar', texture=tiles(256, 4, (0.88, 0.83, 0.74), (0.80, 0.74, 0.64), (0.52, 0.46, 0.38), 0.012, 21), metres=0.88)
    file.material('paving', texture=tiles(512, 4, (0.62, 0.54, 0.44), (0.50, 0.42, 0.33), (0.36, 0.32, 0.27), 0.02, 3), metres=2.4)
    file.material('mosaic', texture=tiles(512, 16, (0.46, 0.74, 0.74), (0.20, 0.54, 0.60), (0.62, 0.70, 0.68), 0.05, 9), metres=0.8)
    file.material('marble', texture=marble(), metres=0.8)
    file.material('linen', texture=linen(*CLOTH_SIZE))
    file.material('left page', texture=page(2))
    file.material('right page', texture=page(0, HEADING))
    file.material('lemon', texture=plaster((0.80, 0.52, 0.04), (0.88, 0.64, 0.08), 31), metres=0.3)
    file.material('paper edge', (0.66, 0.60, 0.50))
    file.material('cedar', texture=wood(), metres=0.4)
    file.material('black', (0.0, 0.0, 0.0))
    file.material('gold', metal='gold')
    file.material('glass', glass=1.52)
    file.material('crystal', glass=1.60)
    # A ball of fused silica focuses almost on the cloth where the sun stands 31 degrees high, one of crystal above it.
    file.material('silica', glass=1.458)
    file.material('flint', glass='785258')
    file.material('wine', glass=1.345, tint=(0.060, (0.86, 0.06, 0.12)))
    file.material('whisky', glass=1.36, tint=(0.050, (0.90, 0.42, 0.06)))
    file.material('water', glass=1.333, tint=(3.5, (0.55, 0.90, 0.92)), waves=[
        wave(0.0018, 0.48, 15, 0.3), wave(0.0016, 0.40, 80, 1.9), wave(0.0012, 0.31, 130, 4.0), wave(0.0007, 0.24, 50, 2.2)])


# ---- the room

def arched_wall(name, material, place, top, arches):
    """A wall along s with round arches (centre, half width, spring height) below a line of points (s, y); place(s, y, depth) is a
    point of it."""
    # Strips end at equal angles of the arches, so that their upper edges follow the rounds.
    steps, origin, top = 24, A(place(0, 0, 0)), A(top)
    cuts, span, height = set(top[:, 0]), top[[0, -1], 0], top[:, 1].max()
    for centre, half, _ in arches:
        cuts |= set(centre - half * np.cos(np.pi * np.arange(steps + 1) / steps))
    cuts = sorted(cuts)

    def foot(s, strip):
        for centre, half, spring in arches:
            if abs(strip - centre) < half:
                return spring + np.sqrt(max(half**2 - (s - centre)**2, 0))
        return 0.0

    # The face towards the room and the one outside: each strip reaches from its arch, or the floor, to the top.
    for depth, normal, owner in ((0.0, place(0, 0, -1), name), (WALL, place(0, 0, 1), 'outside')):
        p = [corner for a, b in zip(cuts[:-1], cuts[1:]) if b - a > 1e-9 for strip in [(a + b) / 2]
             for corner in ((a, foot(a, strip)), (b, foot(b, strip)), (b, np.interp(b, *top.T)), (a, np.interp(a, *top.T)))]
        p, first = A(p), 4 * np.arange(len(p) // 4)[:, None]
        i = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
        uv1 = np.stack([(p[:, 0] - span[0]) / (span[1] - span[0]), 1 - p[:, 1] / height], 1)
        world = A([place(s, y, depth) for s, y in p])
        face = mesh(world, np.tile(A(normal) - origin, (len(p), 1)), i, p * [1, -1], uv1)
        file.add_to(owner, face, material)

    # The reveals: each outline is swept through the wall, with normals into the opening and textures in metres.
    for centre, half, spring in arches:
        a = np.pi * np.arange(steps + 1) / steps
        line = np.vstack([[(centre - half, 0)], np.stack([centre - half * np.cos(a), spring + half * np.sin(a)], 1), [(centre + half, 0)]])
        inward = np.vstack([[(1, 0)], np.stack([np.cos(a), -np.sin(a)], 1), [(-1, 0)]])
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        p = A([[place(s, y, 0), place(s, y, WALL)] for s, y in line])
        n = A([[A(place(s, y, 0)) - origin] * 2 for s, y in inward])
        uv0 = np.stack(np.broadcast_arrays(along[:, None], [0, WALL]), -1)
        file.add_to('reveals', sheet(p, n, uv0), 'ashlar')
        # A surround of the same blocks, a little proud of the wall.
        p = A([[place(*(q - out * BAND), -0.004), place(*q, -0.004)] for q, out in zip(line, inward)])
        uv0 = np.stack(np.broadcast_arrays(along[:, None], [-BAND, 0]), -1)
        file.add_to('reveals', sheet(p, np.broadcast_to(A(place(0, 0, -1)) - origin, p.shape), uv0), 'ashlar')


def flat(x, z, y, up=1):
    return rect([sum(x) / 2, y, sum(z) / 2], [0, 0, up * (z[1] - z[0]) / 2], [(x[1] - x[0]) / 2, 0, 0])


def sides(x, z, y, inwards):
    """The four upright faces of a box."""
    q = -1 if inwards else 1
    middle, half = A([sum(x), sum(y), sum(z)]) / 2, A([x[1] - x[0], y[1] - y[0], z[1] - z[0]]) / 2
    for axis in (A([1.0, 0, 0]), A([0, 0, 1.0])):
        for sign in (1, -1):
            along = np.cross(UP, axis * sign * q)
            yield rect(middle + axis * sign * half, along * half, UP * half)


def add_room():
    outer_x, outer_z = (ROOM_X[0] - WALL, ROOM_X[1] + WALL), (ROOM_Z[0] - WALL, ROOM_Z[1] + WALL)
    # The right wall bends into a vault, which takes the net of the pool.
    spring, width, turn = 1.3, 1.7, np.linspace(0, np.pi / 2, 33)
    arch = np.stack([ROOM_X[1] - width * (1 - np.cos(turn)), spring + (HEIGHT - spring) * np.sin(turn)], 1)
    profile = np.vstack([[(ROOM_X[1], 0.0)], arch])
    normal = np.vstack([[(-1, 0)], np.stack([-np.cos(turn) / width, -np.sin(turn) / (HEIGHT - spring)], 1)])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    p = A([[(x, y, z) for z in ROOM_Z] for x, y in profile])
    n = A([[(x, y, 0)] * 2 for x, y in normal])
    vault = sheet(p, n, np.stack(np.broadcast_arrays(along[:, None], ROOM_Z), -1))
    vault['uv1'] = np.stack(np.broadcast_arrays(A([0.0, 1.0]), (along / along[-1])[:, None]), -1).reshape(-1, 2)
    file.add('wall', vault, 'plaster')
    file.add('ceiling', flat((ROOM_X[0], ROOM_X[1] - width), ROOM_Z, HEIGHT, -1), 'plaster')
    # The other walls: those at its ends follow the vault.
    level, vaulted = [(z, HEIGHT) for z in ROOM_Z], [(ROOM_X[0], HEIGHT), *arch[::-1]]
    arched_wall('left wall', 'plaster', lambda s, y, d: (ROOM_X[0] - d, y, s), level, [(-3.20, 0.80, 1.80), (-0.75, 0.85, 2.20), (1.45, 0.85, 2.20)])
    arched_wall('back wall', 'terracotta', lambda s, y, d: (s, y, ROOM_Z[0] - d), vaulted, [(-0.72, 0.62, 1.42), (0.70, 0.62, 1.42)])
    middle_x, half_x = sum(ROOM_X) / 2, (ROOM_X[1] - ROOM_X[0]) / 2
    file.add('front wall', rect([middle_x, HEIGHT / 2, ROOM_Z[1]], [-half_x, 0, 0], [0, HEIGHT / 2, 0]), 'plaster')
    # A rib of stone where the vault meets them.
    line, normal = np.vstack([profile, [(ROOM_X[0], HEIGHT)]]), np.vstack([normal, [(0, -1)]])
    along, inner = np.append(along, along[-1] + ROOM_X[1] - width - ROOM_X[0]), line + BAND * unit(normal)
    for wall, out in zip(ROOM_Z, (1, -1)):
        face = A([[(*q, wall + out * 0.06) for q in pair] for pair in zip(line, inner)])
        soffit = A([[(*q, wall), (*q, wall + out * 0.06)] for q in inner])
        for p, n in ((face, np.broadcast_to([0, 0, out], face.shape)), (soffit, np.insert(normal, 2, 0, 1)[:, None].repeat(2, 1))):
            file.add_to('reveals', sheet(p, n, np.stack(np.broadcast_arrays(along[:, None], [-BAND, 0]), -1)), 'ashlar')
    # A dark terrace: a pale one would fill the vault with light and drown the net.
    file.add_to('outside', flat(outer_x, outer_z, HEIGHT + 0.25), 'marble')
    file.add_to('outside', flat((-6.0, outer_x[0]), (-8.0, 3.8), 0.0), 'marble')
    file.add_to('outside', flat((outer_x[0], 6.0), (-8.0, outer_z[0]), 0.0), 'marble')


def add_pool():
    rim_x, rim_z = (POOL_X[0] - 0.16, POOL_X[1] + 0.16), (POOL_Z[0] - 0.16, POOL_Z[1] + 0.16)
    for x, z in (((ROOM_X[0] - WALL, ROOM_X[1]), (rim_z[1], ROOM_Z[1])), ((ROOM_X[0] - WALL, rim_x[0]), (ROOM_Z[0] - WALL, rim_z[1])),
                 ((rim_x[1], ROOM_X[1]), (ROOM_Z[0] - WALL, rim_z[1])), (rim_x, (ROOM_Z[0] - WALL, rim_z[0]))):
        file.add_to('floor', flat(x, z, 0.0), 'paving')
    for face in sides(POOL_X, POOL_Z, (BOTTOM, RIM), True):
        file.add_to('pool sides', face, 'mosaic')
    file.add('pool floor', flat(POOL_X, POOL_Z, BOTTOM), 'mosaic')
    for face in sides(rim_x, rim_z, (0.0, RIM), False):
        file.add_to('rim', face, 'stone')
    for x, z in (((rim_x[0], POOL_X[0]), rim_z), ((POOL_X[1], rim_x[1]), rim_z), (POOL_X, (rim_z[0], POOL_Z[0])), (POOL_X, (POOL_Z[1], rim_z[1]))):
        file.add_to('rim', flat(x, z, RIM), 'stone')
    # A little into its walls, so that no light comes between.
    file.add('water', flat((POOL_X[0] - 0.004, POOL_X[1] + 0.004), (POOL_Z[0] - 0.004, POOL_Z[1] + 0.004), WATER), 'water')


def add_table():
    """A slab with rounded edge on two blocks, and a cloth that receives the light of the glasses."""
    bevel, thick, turn = 0.012, 0.045, np.linspace(0, np.pi / 2, 8)
    (x0, x1), (z0, z1) = ((a + bevel, b - bevel) for a, b in (TABLE_X, TABLE_Z))
    file.add_to('table', flat((x0, x1), (z0, z1), TABLE), 'marble')
    # Profile of the edge: out, down, out of the normal, up of the normal.
    upper = [(bevel * np.sin(t), bevel * np.cos(t) - bevel, np.sin(t), np.cos(t)) for t in turn]
    lower = [(out, -thick - down, n_out, -n_up) for out, down, n_out, n_up in upper[::-1]]
    corners = [A([x0, z0, -1, -1]), A([x1, z0, 1, -1]), A([x1, z1, 1, 1]), A([x0, z1, -1, 1])]
    for k, (nx, nz) in enumerate([(0, -1), (1, 0), (0, 1), (-1, 0)]):
        ends = (corners[k], corners[(k + 1) % 4])
        p = A([[(c[0] + c[2] * out, TABLE + h, c[1] + c[3] * out) for c in ends] for out, h, _, _ in upper + lower])
        n = A([[(nx * out, up, nz * out)] * 2 for _, _, out, up in upper + lower])
        file.add_to('table', sheet(p, n, np.stack([p[..., 0] + p[..., 2], p[..., 1]], -1)), 'marble')
    file.add_to('table', flat((x0, x1), (z0, z1), TABLE - thick, -1), 'marble')
    for x in (TABLE_X[0] + 0.3, TABLE_X[1] - 0.3):
        for face in sides((x - 0.11, x + 0.11), (TABLE_Z[0] + 0.2, TABLE_Z[1] - 0.2), (0.0, TABLE - thick), False):
            file.add_to('rim', face, 'stone')
    along, across = (rotation(UP, 3) @ A([[CLOTH_SIZE[0] / 2, 0, 0], [0, 0, CLOTH_SIZE[1] / 2]]).T).T
    cloth = rect([0.11, TABLE + 0.0012, 0.64], across, along)
    file.add('cloth', dict(cloth, uv0=cloth['uv1']), 'linen')


# ---- exhibits

def on_cloth(x, z):
    return A([x, CLOTH + 0.0003, z])


WINE_GLASS, TUMBLER, BOOK, BALL = on_cloth(0.10, 0.47), on_cloth(0.42, 0.48), on_cloth(0.04, 0.81), on_cloth(-0.20, 0.55)


def add_wine_glass():
    # The bowl narrows upwards: light that enters its side leaves it opposite and draws a leaf of ruby in the shadow.
    outline = [[0, .001], [.022, .0010], [.036, .0008], [.0400, .0014], [.0412, .0026], [.0400, .0038], [.034, .0052], [.020, .0085],
               [.0085, .0155], [.0055, .0240], [.0052, .0370], [.0072, .0420], [.0220, .0440], [.0430, .0520], [.0520, .0700], [.0505, .0970],
               [.0445, .1270], [.0395, .1520], [.0375, .1660], [.0373, .1668], [.0368, .1672], [.0363, .1668], [.0361, .1658], [.0381, .1518],
               [.0431, .1267], [.0491, .0968], [.0506, .0702], [.0421, .0531], [.0215, .0453], [.0108, .0421], [0, .0409]]
    # Wider than the bowl by 0.7 mm, so that no air is between.
    wine = [[0, .0402], [.0108, .0413], [.0218, .0447], [.0425, .0525], [.0513, .0701], [.0498, .0969], [.0438, .1269], [.0424, .1340]]
    file.add('wine glass', moved(lathe([outline], 96, 4), WINE_GLASS), 'glass')
    file.add('wine', moved(lathe([wine, [[.0424, .1340], [0, .1340]]], 96, 4), WINE_GLASS), 'wine')


def add_tumbler(n=14, finer=8):
    """Cut crystal: four bands of facets below a smooth rim, and a star in the foot."""
    rings = [ring(n, .0385, .0008), ring(n, .0425, .013, .5), ring(n, .0438, .030), ring(n, .0446, .047, .5), ring(n, .0440, .060)]
    edge = ring(n * finer, .0436, .0655)
    sides, foot = [], []
    for i in range(n):
        j = (i + 1) % n
        for level in range(4):
            low, high = rings[level], rings[level + 1]
            if level % 2 == 0:
                sides += [[low[i], high[i], low[j]], [low[j], high[i], high[j]]]
            else:
                sides += [[high[i], low[i], high[j]], [high[j], low[i], low[j]]]
        for m in range(finer):
            sides.append([rings[4][i if m < finer // 2 else j], edge[i * finer + m], edge[(i * finer + m + 1) % len(edge)]])
        sides.append([rings[4][i], edge[i * finer + finer // 2], rings[4][j]])
        star = ring(n, .019, .0052, .5)
        foot += [[rings[0][i], rings[0][j], star[i]], [star[i], rings[0][j], star[j]], [star[i], star[j], A([0, .0075, 0])]]
    inside = lathe([[[.0436, .0655], [.0440, .080], [.0444, .0915], [.0442, .0930], [.0432, .0936], [.0422, .0930], [.0420, .0915], [.0410, .060],
                     [.0396, .030], [.0380, .0220], [.0320, .0172], [.018, .0160], [0, .0158]]], n * finer, 4)
    parts = [facets(sides, (0, .03, 0)), facets(foot, (0, .03, 0)), dict(inside, uv0=None, uv1=None)]
    whisky = [[0, .0150], [.018, .0152], [.0325, .0166], [.0386, .0215], [.0401, .030], [.0407, .046]]
    file.add('tumbler', moved(join(*parts), TUMBLER, rotation(UP, 11)), 'crystal')
    file.add('whisky', moved(lathe([whisky, [[.0407, .046], [0, .046]]], 96, 3), TUMBLER), 'whisky')


def add_ball(radius=0.056):
    arc = [[radius * np.sin(t), radius - radius * np.cos(t)] for t in np.linspace(0, np.pi, 13)]
    arc[0][0] = arc[-1][0] = 0.0
    file.add('ball', moved(lathe([arc]), BALL), 'silica')


def add_book(half_width=0.155, half_height=0.115):
    """An open book whose pages rise to the fold, and a bangle on the right one."""
    turn, u = rotation(UP, 14), np.linspace(0, 1, 29)
    x, y = half_width * u, 0.006 + 0.023 * (1 - np.exp(-u / 0.10)) * (1 - u)**0.75 + 0.004 * (1 - u)
    z = A([-half_height, 0, half_height])
    along = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    add_edge = lambda m: file.add_to('book', moved(m, BOOK, turn), 'paper edge')
    for name, side in (('left page', -1), ('right page', 1)):
        p = A([[(side * a, b, c) for c in z] for a, b in zip(x, y)])
        n = A([[(-side * dy, dx, 0)] * 3 for dx, dy in zip(np.gradient(x), np.gradient(y))])
        leaf = sheet(p, n)
        # By length along the page, so that texels are of one size.
        across = np.repeat(along / along[-1], 3)
        uv = np.stack([across if side > 0 else 1 - across, (p[..., 2].ravel() / half_height + 1) / 2], 1)
        file.add(name, moved(dict(leaf, uv0=uv, uv1=uv), BOOK, turn), name)
        for end in (z[0], z[2]):
            p = A([[(side * a, b, end), (side * a, 0.003, end)] for a, b in zip(x, y)])
            add_edge(sheet(p, np.tile([0, 0, end], (len(x), 2, 1))))
        add_edge(rect([side * half_width, (y[-1] + 0.003) / 2, 0], [0, 0, -side * half_height], [0, (y[-1] - 0.003) / 2, 0]))
    add_edge(rect([0, 0.0025, 0], [0, 0, half_height + 0.005], [half_width + 0.005, 0, 0]))
    inner, thick, high = 0.040, 0.0016, 0.022
    profile = [(0, high), (0, 0), (.2, 0), (.5, -.0005), (1, .0006), (1.25, high * .3), (1.25, high * .7), (1, high - .0006), (.5, high + .0005), (.2, high), (0, high)]
    profile = [[inner + out * thick, .001 + y] for out, y in profile]
    place = BOOK + turn @ A([0.085, 0.0163, 0.01])
    file.add('ring', moved(lathe(list(zip(profile[:-1], profile[1:])), 160), place, turn @ rotation([0, 0, 1], -8)), 'gold')


def add_lemon(length=0.082, radius=0.030):
    outline = A([[0, 0], [.42, .05], [.84, .20], [1, .44], [.86, .70], [.48, .90], [.20, .975], [0, 1]]) * [radius, length]
    lemon = moved(lathe([outline], 40, 2), turn=rotation(UP, -28) @ rotation([0, 0, 1], 86))
    file.add('lemon', moved(lemon, on_cloth(0.335, 0.845) - UP * lemon['p'][:, 1].min()), 'lemon')


def add_prism():
    """A bar of dense flint on two posts by the pool, between the sun and the place of its spectrum on the vault."""
    side, half, centre, index = 0.07, 0.21, A([-0.98, 0.77, -2.98]), 1.785
    out = unit(A([1.92, 1.68, -2.70]) - centre)
    along = unit(np.cross(SUN, out))
    # At least deviation the light inside runs along the base, and both faces turn it alike.
    turn = np.arccos(SUN @ out) / 2
    apex_rad = 2 * np.arctan2(np.sin(turn), index - np.cos(turn))
    inside = unit(SUN + out)
    up = unit(out - SUN)
    base = 2 * side * np.sin(apex_rad / 2)
    tall = side * np.cos(apex_rad / 2)
    outline = [centre - up * tall / 2, centre + up * tall / 2 + inside * base / 2, centre + up * tall / 2 - inside * base / 2]
    a, b = ([p + along * end for p in outline] for end in (-half, half))
    quads = [(a[i], a[j], b[j], b[i]) for i, j in ((0, 1), (1, 2), (2, 0))]
    triangles = [a, b] + [[q[k] for k in pick] for q in quads for pick in ((0, 1, 2), (0, 2, 3))]
    file.add('prism', facets(triangles, centre), 'flint')
    # Its edge rests in a groove of each post.
    for end in (0.03 - half, half - 0.03):
        foot = centre - up * (tall / 2 - 0.004) + along * end
        file.add_to('stands', box((-0.009, RIM - foot[1], -0.009), (0.009, 0, 0.009), origin=foot), 'cedar')


def add_butterfly():
    """A plate whose front is ground so that the sun behind it draws a butterfly on a slab."""
    side, gap, index, thick = 0.24, 0.42, 1.52, 0.014
    centre = A([-0.75, 1.30, 1.95])
    right = unit(np.cross(SUN, UP))
    up = np.cross(right, SUN)
    file.add('lens', relief(centre, right, up, SUN, side, thick, gap, index), 'glass')
    frame, inner, outer = A([right, up, SUN]), side / 2 - 0.001, side / 2 + 0.075
    for low, high in (((-outer, inner), (outer, outer)), ((-outer, -outer), (outer, -inner)), ((-outer, -inner), (-inner, inner)), ((inner, -inner), (outer, inner))):
        file.add_to('stands', box((*low, 0.0), (*high, 0.02), frame, centre), 'cedar')
    ahead = unit(SUN * [1, 0, 1])
    foot = centre - up * outer + SUN * 0.01
    file.add_to('stands', box((-0.015, -foot[1] - 0.02, -0.25), (0.015, 0.01, -0.21), A([ahead, UP, right]), foot), 'cedar')
    file.add_to('stands', box((-0.015, -foot[1] - 0.02, 0.21), (0.015, 0.01, 0.25), A([ahead, UP, right]), foot), 'cedar')
    hit = centre + SUN * (gap / (SUN @ ahead))
    file.add('slab', rect(hit, right * 0.20, UP * 0.22), 'plaster')
    board = A([right, UP, ahead])
    file.add_to('stands', box((-0.215, -0.235, 0.002), (0.215, 0.235, 0.03), board, hit), 'cedar')
    file.add_to('stands', box((-0.02, -hit[1] - 0.02, 0.004), (0.02, -0.235, 0.028), board, hit), 'cedar')


# ---- sky and sea

DOME, EYE = 40.0, A([0.0, 1.15, 0.0])
# Most texels go where the arches show them: azimuth from the back wall and elevation [degrees] along an image, from 0 to 1.
AZIMUTH = (0, 0.05, 0.22, 0.92, 1), (-180, -125, -32, 32, 180)
ELEVATION = (0, 0.16, 0.58, 0.95, 1), (90, 14, 0, -8.5, -90)
SEA_BELOW_EYE_M = 6.0


def bearing(azimuth, elevation):
    return np.stack([np.sin(azimuth) * np.cos(elevation), np.sin(elevation), -np.cos(azimuth) * np.cos(elevation)], -1)


def over(below, colour, cover):
    return below + (A(colour) - below) * cover[..., None]


def air(direction):
    """Clear sky: warm haze, blue above, and a glow around the sun."""
    up = np.clip(direction[..., 1:2], 0, 1)
    off_sun = np.arccos(np.clip(direction @ -SUN, -1, 1))[..., None]
    glow = A([0.30, 0.20, 0.10]) * np.exp(-off_sun / 0.2) + A([0.06, 0.035, 0.012]) * np.exp(-off_sun / 0.7)
    return A([0.025, 0.075, 0.15]) + A([0.16, 0.25, 0.34]) * np.exp(-up / 0.20) + A([0.60, 0.37, 0.12]) * np.exp(-up / 0.05) + glow


def sea(azimuth, elevation):
    """Waves on a plane, each as far as the texels there can show it; what they cannot show is roughness."""
    outward, far = bearing(azimuth, 0 * elevation), SEA_BELOW_EYE_M / np.tan(np.maximum(-elevation, 4e-4))
    at, blur, random = outward * far[..., None], far**2 / SEA_BELOW_EYE_M * -np.gradient(elevation, axis=0), np.random.default_rng(5)
    gust = np.clip(1 + 1.5 * fractal(at[..., 0] / 40, at[..., 2] / 60, 71, 5), 0.1, 2.4)
    slope, height, rough = 0.0, 0.0, 0.0
    for wavelength in np.geomspace(0.3, 8, 52):
        heading, k = 0.5 + 0.95 * random.normal(), 2 * np.pi / wavelength
        along = A([np.sin(heading), 0, np.cos(heading)])
        seen, phase = np.exp(-0.5 * (0.4 * k * np.hypot(outward @ along, 0.3) * blur)**2), k * (at @ along) + random.uniform(0, 7)
        slope = slope + (seen * np.cos(phase))[..., None] * along
        height, rough = height + seen * np.sin(phase) / k, rough + (1 - seen**2) / 2
    # Seen from low down, faces that lean to the eye hide the others.
    steep = 0.024 * np.sqrt(gust)[..., None]
    n, view = unit(UP - steep * (slope + 0.65 * outward * np.sqrt(rough)[..., None])), -bearing(azimuth, elevation)
    cosine = np.clip((n * view).sum(-1, keepdims=True), 0.03, 1)
    fresnel, crest = 0.02 + 0.98 * (1 - cosine)**5, np.clip(0.5 + 0.22 * height, 0, 1)
    out = fresnel * air(2 * cosine * n - view) + (1 - fresnel) * over(A([0.004, 0.045, 0.068]), [0.014, 0.105, 0.125], crest)
    foam = np.clip(height - 4.7, 0, 1) * np.clip(fractal(at[..., 0] / 0.8, at[..., 2] / 1.5, 72, 4) * 2.5, 0, 1)
    return over(over(out, [0.75, 0.74, 0.70], foam), air(outward), 1 - np.exp(-far / 15e3))


def sky(width=2304, height=704):
    x, y = np.meshgrid(*(np.interp((np.arange(n) + 0.5) / n, *knots) for n, knots in ((width, AZIMUTH), (height, ELEVATION))))
    azimuth, elevation = np.radians(x), np.radians(y)
    # Clouds with a flat foot, lit from the upper left: thinner there than behind.
    rising = lambda x, y: np.clip((4.2 - y + 4.5 * fractal(x / 8 + 3.1, 0 * y, 91, 3)) / 2.2, -1.2, 0.6) - 1.2 * np.exp(-np.clip(y - 1, 0, 9) / 0.3)
    heap = lambda x, y: rising(x, y) + 0.8 * fractal(x / 2.4, y / 1.6, 92, 6, 0.55)
    cirrus = np.clip(fractal(x / 9 + y / 5, y / 1.1, 93, 5) * 1.2 - 0.1, 0, 1) * np.exp(-((y - 11) / 6)**2)
    out, density = over(air(bearing(azimuth, elevation)), [0.62, 0.60, 0.60], 0.5 * cirrus), heap(x, y)
    lit = np.clip(0.45 + 1.1 * (density - heap(x - 0.7, y + 0.5)), 0, 1)
    out = over(out, over(A([0.34, 0.36, 0.41]), [1.0, 0.92, 0.80], lit), 0.9 * np.clip(2.2 * density, 0, 1) * np.clip((y - 0.6) / 2.5, 0, 1))
    for low, rise, tone, seed in ((0.10, 0.8, (0.40, 0.42, 0.47), 41), (-0.3, 2.2, (0.22, 0.25, 0.28), 43)):
        bulk = np.exp(-np.clip(x - 20, 0, 99) / 10) / (1 + np.exp(-(x - 6.5) / 1.8))
        land = low + rise * (bulk + 0.35 * fractal(x / 5, 0 * y, seed, 6))
        faces = 1 + 0.17 * fractal(x / 0.8 + 0.9 * y, y / 0.9, seed + 1, 5)
        out = over(out, tinted(faces, tone), np.clip((land - y) / 0.05, 0, 1))
    wet = y[:, 0] < 0
    out[wet] = sea(azimuth[wet], elevation[wet])
    # A boat under sail half a mile out: jib, mainsail and hull.
    right, up = x + 10.4, y + 0.42
    for side, wide, tall in ((1, 0.30, 1.15), (-1, 0.22, 0.85)):
        out = over(out, [0.95, 0.90, 0.80], np.clip(np.minimum(side * right - 0.015, wide * (1 - up / tall) - side * right) / 0.03, 0, 1) * (up > 0.06))
    return over(out, [0.10, 0.10, 0.11], np.clip((0.08 - np.hypot(right / 4, up)) / 0.03, 0, 1) * (up > -0.05))


def add_sky():
    """A painted dome that one lamp above the roof lights: all of its light comes as indirect light, without noise. It has an
    opening for the sun, and a screen keeps the lamp off the house and its terrace."""
    file.material('sky', texture=sky())
    x, y = ([a + (b - a) * t for (a, b), n in zip(zip(knots[:-1], knots[1:]), counts) for t in np.arange(n) / n] + [knots[-1]]
            for (_, knots), counts in ((AZIMUTH, (8, 15, 10, 24)), (ELEVATION, (7, 4, 3, 8))))
    uv = np.stack(np.meshgrid(np.interp(x, *AZIMUTH[::-1]), np.interp(-A(y), -A(ELEVATION[1]), ELEVATION[0]), indexing='ij'), -1)
    p = EYE + DOME * bearing(*np.radians(np.meshgrid(x, y, indexing='ij')))
    dome = sheet(p, EYE - p, uv)
    middle = unit(dome['p'][dome['i']].mean(1) - EYE)
    dome['i'] = dome['i'][middle @ -SUN < np.cos(np.radians(9))]
    file.add('sky', dict(dome, uv1=dome['uv0']), 'sky')
    lamp = A([0.15, HEIGHT + 7.0, -0.7])
    file.add('screen', rect(lamp - UP * 1.2, [0.76, 0, 0], [0, 0, -0.90]), 'black')
    file.lamp('sky', lamp, SKY_W_PER_M2 * DOME**2, SKY_COLOUR)
    file.sun('sun', SUN, SUN_W_PER_M2, SUN_COLOUR, 0.53)


def add_cameras():
    file.camera('overview', [-0.11, 0.97, 1.27], [0.165, 0.890, 0.3], 0.76)
    file.camera('wine glass', [0.17, 0.98, 1.00], [0.215, 0.82, 0.50], 0.46)
    file.camera('tumbler', [0.46, 1.00, 0.86], [0.485, 0.78, 0.52], 0.46)
    file.camera('ring', [0.12, 0.96, 1.00], [0.13, 0.765, 0.805], 0.42)
    file.camera('pool', [-0.75, 1.55, -0.65], [0.85, -0.10, -2.05], 0.85)
    file.camera('ceiling', [-0.90, 1.15, -1.10], [1.95, 1.45, -1.60], 0.72)
    file.camera('prism', [-1.64, 1.04, -2.22], [-0.75, 0.99, -2.69], 0.70)
    file.camera('butterfly', [-0.62, 1.45, 1.25], [-0.52, 1.13, 2.05], 0.72)


add_materials()
add_room()
add_pool()
add_table()
add_wine_glass()
add_tumbler()
add_ball()
add_book()
add_lemon()
add_prism()
add_butterfly()
add_sky()
add_cameras()
path = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'gallery.glb')
file.save(path)
print(f'{len(file.objects)} objects, {file.triangles} triangles, {os.path.getsize(path)} bytes, normals within {file.roundest:.4f}')
