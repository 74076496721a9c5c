"""Meshes, textures and a glTF writer, in numpy only. Lengths in metres, y up."""
import json
import struct
import zlib

import numpy as np


def unit(v):
    v = np.asarray(v, float)
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-30)


# ---- meshes: dict of p (positions), n (normals), i (triangles), uv0 (texture), uv1 (map)

# Largest turn of a curve from one row of a solid of revolution to the next [rad]. Normals of vertices then differ by half of
# it from those of triangles, 8 degrees less what the other direction takes.
MAX_TURN = np.radians(13)


def face_vectors(p, i):
    """Normals of triangles, twice their area long."""
    a, b, c = p[i[:, 0]], p[i[:, 1]], p[i[:, 2]]
    return np.cross(b - a, c - a)


def mesh(p, n, i, uv0=None, uv1=None):
    """Drops empty triangles and turns each to the side of its normals."""
    p, n, i = np.asarray(p, float), unit(n), np.asarray(i, np.uint32).reshape(-1, 3)
    face = face_vectors(p, i)
    keep = np.linalg.norm(face, axis=1) > 1e-13
    i, face = i[keep], face[keep]
    flip = np.einsum('ij,ij->i', face, n[i].sum(1)) < 0
    i[flip] = i[flip][:, ::-1]
    return dict(p=p, n=n, i=i, uv0=uv0, uv1=uv1)


def join(*parts):
    starts = np.cumsum([0] + [len(m['p']) for m in parts])
    has = lambda k: all(m[k] is not None for m in parts)
    out = {k: np.concatenate([m[k] for m in parts]) if has(k) else None for k in ('p', 'n', 'uv0', 'uv1')}
    return dict(out, i=np.concatenate([m['i'] + start for m, start in zip(parts, starts)]))


def moved(m, offset=(0, 0, 0), turn=np.eye(3)):
    return dict(m, p=m['p'] @ turn.T + np.asarray(offset, float), n=m['n'] @ turn.T)


def rotation(axis, degrees):
    x, y, z = unit(axis)
    t, k = np.radians(degrees), np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(t) * k + (1 - np.cos(t)) * k @ k


def rect(centre, u, v):
    """Rectangle with half axes u, v that faces u × v; its texture is in metres."""
    c, u, v = (np.asarray(x, float) for x in (centre, u, v))
    a, b = np.array([-1, -1, 1, 1]), np.array([-1, 1, -1, 1])
    p = c + a[:, None] * u + b[:, None] * v
    uv0 = np.stack([p @ unit(u), -p @ unit(v)], 1)
    uv1 = np.stack([(a + 1) / 2, (1 - b) / 2], 1)
    return mesh(p, np.tile(np.cross(u, v), (4, 1)), [(0, 2, 1), (1, 2, 3)], uv0, uv1)


def box(low, high, axes=np.eye(3), origin=(0, 0, 0)):
    """Cuboid between two corners in a frame of three axes (rows)."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    middle, half = (low + high) / 2, (high - low) / 2
    faces, longest = [], np.argmax(half)
    for k in range(3):
        for sign in (-1, 1):
            out, u, v = np.eye(3)[k] * sign, np.eye(3)[(k + 1) % 3], np.eye(3)[(k + 2) % 3]
            u, v = (u, v) if sign > 0 else (v, u)
            face = rect(middle + out * half, u * half, v * half)
            # The grain of wood runs along the longest side. Each face has a cell of its own in the map.
            p = face['p']
            face['uv0'] = np.stack([p[:, longest], p.sum(1) - p[:, longest]], 1)
            face['uv1'] = (face['uv1'] * 0.94 + 0.03 + [k, (sign + 1) / 2]) / 3
            faces.append(face)
    # The frame may be left-handed: `mesh` turns the triangles.
    return mesh(**moved(join(*faces), origin, np.asarray(axes, float).T))


def sheet(p, n, uv0=None):
    """Grid of points p[a, b] with normals n[a, b]."""
    rows, columns = p.shape[:2]
    k = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[:-1, 1:], k[1:, 1:]
    i = np.stack([a, b, c, c, b, d], -1)
    uv = np.stack(np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing='ij'), -1).reshape(-1, 2)
    return mesh(p.reshape(-1, 3), n.reshape(-1, 3), i, uv if uv0 is None else uv0.reshape(-1, 2), uv)


def smooth(points, rows):
    """Cubic curve through (r, y) with the slopes of parabolas: points and tangents, at least so many rows between two
    points. Meets the axis at a right angle."""
    q = np.asarray(points, float)
    beyond = lambda end, next: next * [-1, 1] if abs(end[0]) < 1e-12 else 2 * end - next
    q = np.vstack([beyond(q[0], q[1]), q, beyond(q[-1], q[-2])])
    length = np.linalg.norm(np.diff(q, axis=0), axis=1)
    before, after = length[:-1, None], length[1:, None]
    slope = ((q[1:-1] - q[:-2]) / before * after + (q[2:] - q[1:-1]) / after * before) / (before + after)
    p, tangent = [], []
    for k in range(len(slope) - 1):
        p0, p1, m0, m1 = q[k + 1], q[k + 2], slope[k] * length[k + 1], slope[k + 1] * length[k + 1]
        along = lambda t: (p0 - p1) * (6 * t**2 - 6 * t) + m0 * (3 * t**2 - 4 * t + 1) + m1 * (3 * t**2 - 2 * t)
        # Rows are as close as the turn or the number of rows asks for, whichever is more.
        fine = np.linspace(0, 1, 257)
        heading = unit(along(fine[:, None]))
        turn = np.arccos(np.clip((heading[1:] * heading[:-1]).sum(1), -1, 1))
        row = np.concatenate([[0], np.cumsum(np.maximum(turn / MAX_TURN, rows * np.diff(fine)))])
        t = np.interp(np.linspace(0, row[-1], int(np.ceil(row[-1] - 1e-9)) + 1), row, fine)
        t = t[0 if k == 0 else 1:, None]
        p.append(p0 * (2 * t**3 - 3 * t**2 + 1) + m0 * (t**3 - 2 * t**2 + t) + p1 * (3 * t**2 - 2 * t**3) + m1 * (t**3 - t**2))
        tangent.append(along(t))
    p = np.vstack(p)
    p[np.abs(p[:, 0]) < 1e-9, 0] = 0
    return p, unit(np.vstack(tangent))


def lathe(curves, around=96, rows=5):
    """Solid of revolution; outlines of (r, y) run bottom axis, out, up, in. Outlines of two points are straight."""
    angle = 2 * np.pi * (np.arange(around + 1) % around) / around
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    out = []
    for curve in curves:
        straight = len(curve) == 2
        p, t = (np.asarray(curve, float), unit(np.gradient(np.asarray(curve, float), axis=0))) if straight else smooth(curve, rows)
        spin = lambda r, y: np.stack([r * c, y + 0 * c, r * s], -1)
        out.append(sheet(spin(p[:, 0], p[:, 1]), spin(t[:, 1], -t[:, 0])))
    return join(*out)


def facets(triangles, centre):
    """Flat triangles that face away from a point inside."""
    t = np.asarray(triangles, float).reshape(-1, 3, 3)
    n = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    keep = np.linalg.norm(n, axis=1) > 1e-14
    t, n = t[keep], n[keep]
    n[np.einsum('ij,ij->i', n, t.mean(1) - centre) < 0] *= -1
    return mesh(t.reshape(-1, 3), np.repeat(n, 3, 0), np.arange(3 * len(t)))


def ring(corners, r, y, turn=0.0):
    a = 2 * np.pi * (np.arange(corners) + turn) / corners
    return np.stack([r * np.cos(a), np.full(corners, y), r * np.sin(a)], 1)


# ---- textures: arrays of linear colour

def fractal(x, y, seed, octaves=5, gain=0.5, period=None):
    """Value noise at any points, roughly -1 to 1, with cells of 1 in its first octave; may repeat after so many of them."""
    grid, out, amplitude, total = np.random.default_rng(seed).uniform(-1, 1, (256, 256)), 0.0, 1.0, 0.0
    for octave in range(octaves):
        i, j = np.floor(x).astype(int), np.floor(y).astype(int)
        fx, fy = (f * f * (3 - 2 * f) for f in (x - i, y - j))
        wrap = [256 if period is None else cells << octave for cells in period or (0, 0)]
        a, b, c, d = [grid[(i + m) % wrap[0] & 255, (j + n) % wrap[1] & 255] for m in (0, 1) for n in (0, 1)]
        out = out + amplitude * (a + (c - a) * fx + (b - a + (a - b - c + d) * fx) * fy)
        total, amplitude = total + amplitude, amplitude * gain
        # Each octave is turned if it may, so that its cells do not line up with the last.
        x, y = (2 * x, 2 * y) if period else (1.6 * x - 1.2 * y + 17, 1.2 * x + 1.6 * y + 31)
    return out / total * 1.6


def noise(shape, cells, seed, octaves=5, gain=0.5):
    y, x = (np.arange(n) * c / n for n, c in zip(shape, cells))
    return fractal(y[:, None], x[None, :], seed, octaves, gain, cells)


def png(linear):
    """8 bits for each colour, or a palette where so few are."""
    v = np.clip(linear, 0, 1)
    v = (np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055) * 255 + 0.5).astype(np.uint8)
    height, width, _ = v.shape
    palette, index = np.unique(v.astype(int) @ [65536, 256, 1], return_inverse=True)
    few = len(palette) <= 256
    v = index.reshape(height, width, 1).astype(np.uint8) if few else v
    # As differences from the left or from above, whichever packs better.
    change = [np.diff(v, axis=1, prepend=np.zeros_like(v[:, :1])), np.diff(v, axis=0, prepend=np.zeros_like(v[:1]))]
    packed = [zlib.compress(b''.join(kind + row.tobytes() for row in rows), 9) for kind, rows in zip((b'\1', b'\2'), change)]
    chunk = lambda kind, data: struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
    head = chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 8, 3 if few else 2, 0, 0, 0))
    head += chunk(b'PLTE', b''.join(int(c).to_bytes(3, 'big') for c in palette)) if few else b''
    return b'\x89PNG\r\n\x1a\n' + head + chunk(b'IDAT', min(packed, key=len)) + chunk(b'IEND', b'')


# ---- glTF

class File:
    def __init__(self):
        self.data, self.views, self.accessors = bytearray(), [], []
        self.meshes, self.objects, self.others, self.materials, self.images = [], [], [], [], []
        self.lights, self.cameras, self.names, self.atlases = [], [], {}, {}
        self.triangles, self.roundest = 0, 1.0

    def _view(self, data):
        self.data += b'\0' * (-len(self.data) % 4)
        self.views.append({'buffer': 0, 'byteOffset': len(self.data), 'byteLength': len(data)})
        self.data += data
        return len(self.views) - 1

    def _accessor(self, a, kind):
        component = {'uint16': 5123, 'uint32': 5125, 'float32': 5126}[a.dtype.name]
        entry = {'bufferView': self._view(a.tobytes()), 'componentType': component, 'count': len(a), 'type': kind}
        if kind == 'VEC3':
            entry.update(min=a.min(0).tolist(), max=a.max(0).tolist())
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def material(self, name, colour=(1, 1, 1), texture=None, metres=1.0, glass=None, tint=None, metal=None, waves=None):
        """`texture` repeats every so many metres. `glass` is an index or a name, `tint` a distance and a colour."""
        surface = {'baseColorFactor': [*colour, 1.0], 'metallicFactor': 0.0, 'roughnessFactor': 1.0}
        out, extensions, extras = {'name': name, 'pbrMetallicRoughness': surface}, {}, {}
        if texture is not None:
            self.images.append({'bufferView': self._view(png(texture)), 'mimeType': 'image/png'})
            scale = {'KHR_texture_transform': {'scale': [1 / metres, 1 / metres]}}
            surface['baseColorTexture'] = {'index': len(self.images) - 1, 'extensions': scale}
        if metal:
            surface.update(metallicFactor=1.0, roughnessFactor=0.0)
            extras['metal'] = metal
        if glass:
            surface['roughnessFactor'] = 0.0
            volume = {'thicknessFactor': 1.0}
            if tint:
                volume.update(attenuationDistance=tint[0], attenuationColor=list(tint[1]))
            extensions.update(KHR_materials_transmission={'transmissionFactor': 1.0}, KHR_materials_volume=volume)
            if isinstance(glass, str):
                extras['glass'] = glass
            else:
                extensions['KHR_materials_ior'] = {'ior': glass}
        if waves:
            extras['nephroid_waves'] = waves
        out.update({k: v for k, v in (('extensions', extensions), ('extras', extras)) if v})
        self.names[name] = len(self.materials)
        self.materials.append(out)

    def add(self, name, m, material):
        faces = unit(face_vectors(m['p'], m['i']))
        self.roundest = min(self.roundest, np.einsum('ij,ikj->ik', faces, m['n'][m['i']]).min())
        floats = lambda k: self._accessor(m[k].astype(np.float32), 'VEC2' if k in ('uv0', 'uv1') else 'VEC3')
        attributes = {'POSITION': floats('p'), 'NORMAL': floats('n')}
        if m['uv0'] is not None and 'baseColorTexture' in self.materials[self.names[material]]['pbrMetallicRoughness']:
            attributes['TEXCOORD_0'] = floats('uv0')
        if m['uv1'] is not None and 'extensions' not in self.materials[self.names[material]]:
            attributes['TEXCOORD_1'] = floats('uv1')
        small = np.uint16 if len(m['p']) < 65536 else np.uint32
        part = {'attributes': attributes, 'indices': self._accessor(m['i'].astype(small).ravel(), 'SCALAR'), 'material': self.names[material]}
        self.meshes.append({'primitives': [part]})
        self.objects.append({'name': name, 'mesh': len(self.meshes) - 1})
        self.triangles += len(m['i'])

    def add_to(self, name, m, material):
        """Adds to an object whose parts share one map."""
        self.atlases.setdefault((name, material), []).append(m)

    def _flush(self):
        for (name, material), parts in self.atlases.items():
            side = int(np.ceil(np.sqrt(len(parts))))
            for k, m in enumerate(parts):
                m['uv1'] = (np.array([k % side, k // side]) + 0.03 + 0.94 * m['uv1']) / side
            self.add(name, join(*parts), material)

    @staticmethod
    def _look(eye, to):
        back = unit(np.asarray(eye, float) - to)
        right = unit(np.cross([0, 1, 0], back))
        return [*right, 0, *np.cross(back, right), 0, *back, 0, *map(float, eye), 1]

    def _light(self, name, kind, intensity, colour, matrix, extras):
        self.lights.append({'name': name, 'type': kind, 'intensity': float(intensity), 'color': colour})
        reference = {'KHR_lights_punctual': {'light': len(self.lights) - 1}}
        self.others.append({'name': name, 'matrix': matrix, 'extensions': reference, **({'extras': extras} if extras else {})})

    def sun(self, name, direction, watts_per_m2, colour, degrees):
        self._light(name, 'directional', 683 * watts_per_m2, colour, self._look([0, 0, 0], direction), {'angular_diameter_deg': degrees})

    def lamp(self, name, place, watts_per_sr, colour):
        self._light(name, 'point', 683 * watts_per_sr, colour, self._look(place, place + np.array([0, 0, -1.0])), {})

    def camera(self, name, eye, to, fov_rad):
        lens = {'yfov': fov_rad, 'znear': 0.02, 'aspectRatio': 16 / 9}
        self.cameras.append({'name': name, 'type': 'perspective', 'perspective': lens})
        self.others.append({'name': name, 'matrix': self._look(eye, to), 'camera': len(self.cameras) - 1})

    def save(self, path):
        self._flush()
        nodes = self.objects + self.others
        used = {k for m in self.materials for k in m.get('extensions', {})} | {'KHR_lights_punctual', 'KHR_texture_transform'}
        self.data += b'\0' * (-len(self.data) % 4)
        document = {
            'asset': {'version': '2.0', 'generator': 'gallery.py'}, 'scene': 0, 'scenes': [{'nodes': list(range(len(nodes)))}],
            'nodes': nodes, 'meshes': self.meshes, 'materials': self.materials, 'accessors': self.accessors,
            'bufferViews': self.views, 'buffers': [{'byteLength': len(self.data)}], 'cameras': self.cameras,
            'images': self.images, 'textures': [{'source': k, 'sampler': 0} for k in range(len(self.images))],
            'samplers': [{'wrapS': 10497, 'wrapT': 10497, 'magFilter': 9729, 'minFilter': 9987}],
            'extensionsUsed': sorted(used), 'extensions': {'KHR_lights_punctual': {'lights': self.lights}}}
        text = json.dumps(document, separators=(',', ':'), default=float).encode()
        text += b' ' * (-len(text) % 4)
        with open(path, 'wb') as file:
            file.write(struct.pack('<III', 0x46546C67, 2, 28 + len(text) + len(self.data)))
            file.write(struct.pack('<II', len(text), 0x4E4F534A) + text + struct.pack('<II', len(self.data), 0x004E4942) + self.data)
