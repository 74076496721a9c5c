"""Maps as pictures: found at the left, the reference at the right, white at four times its mean."""

import struct
import zlib

import numpy

WHITE = 4.0


def write(path, found, reference):
    """A grey PNG of two maps of irradiance."""
    both = numpy.hstack([found, reference]) / (WHITE * reference.mean())
    grey = (255 * numpy.clip(both, 0, 1) ** (1 / 2.2)).astype(numpy.uint8)
    rows = numpy.hstack([numpy.zeros((len(grey), 1), numpy.uint8), grey])
    head = struct.pack(">IIBBBBB", grey.shape[1], grey.shape[0], 8, 0, 0, 0, 0)
    parts = [(b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(map(lambda part: chunk(*part), parts)))


def chunk(kind, data):
    """A part of a PNG file."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
