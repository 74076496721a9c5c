// The triangles of a moment, for what the page computes itself: what a ray meets, what the eye is in, and the triangles
// that chains are traced through.

// Stands for no object, on triangles of instanced meshes.
const NO_OBJECT = 0xffffffff;

/** Vectors are arrays of three numbers. */
export const along = (from, direction, distance) => from.map((value, axis) => value + direction[axis] * distance);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (vector) => Math.hypot(...vector);
export const scaled = (vector, factor) => vector.map((value) => value * factor);

export class Geometry {
  constructor(scene) {
    this.scene = scene;
    const { contents: { objects, corners, indices }, vertices, ObjectRecord } = scene;
    const floats = (bytes) => new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
    const [rows, points, numbers] = [floats(objects), floats(corners), new Uint32Array(indices.buffer)];
    const stride = vertices[0].arrayStride / 4, across = ObjectRecord.size / 4, first = ObjectRecord.fields.row_x / 4;
    // Writes where a corner of an object is in the scene [m], given its place in the list of indices.
    this.place = (object, index, into, to) => {
      const at = numbers[index] * stride;
      for (let axis = 0, row = object * across + first; axis < 3; axis += 1, row += 4) {
        into[to + axis] = rows[row] * points[at] + rows[row + 1] * points[at + 1] + rows[row + 2] * points[at + 2] + rows[row + 3];
      }
    };
  }

  /** Each object: number, whether it is a body, corners of its triangles in the scene [m] and the box around them. */
  get shapes() { return (this.made ??= this.makeShapes()); }

  makeShapes() {
    const { contents: { objects }, draws, ObjectRecord: { size, fields } } = this.scene;
    const records = new DataView(objects.buffer, objects.byteOffset);
    const shapes = [];
    for (const [, count, objectCount, first, firstObject] of draws.surfaces) {
      for (let object = firstObject; object < firstObject + objectCount; object += 1) {
        const places = new Float64Array(3 * count);
        const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
        for (let at = 0; at < count; at += 1) this.place(object, first + at, places, 3 * at);
        for (let at = 0; at < places.length; at += 1) {
          low[at % 3] = Math.min(low[at % 3], places[at]);
          high[at % 3] = Math.max(high[at % 3], places[at]);
        }
        shapes.push({ object, isBody: records.getUint32(object * size + fields.solid, true) > 0, places, low, high });
      }
    }
    return shapes;
  }

  /** Distance at which a ray with a unit direction meets something; undefined beyond `most` [m]. */
  meets(from, direction, most = Infinity) {
    let nearest = most;
    const [x, y, z] = direction;
    for (const { places: p, low, high } of this.shapes) {
      let near = 0, far = nearest;
      for (let axis = 0; axis < 3; axis += 1) {
        const [a, b] = [low, high].map((side) => (side[axis] - from[axis]) / (direction[axis] || 1e-30));
        near = Math.max(near, Math.min(a, b));
        far = Math.min(far, Math.max(a, b));
      }
      // Boxes of flat objects have no depth, but for rounding.
      if (near > far * (1 + 1e-6) + 1e-9) continue;
      for (let a = 0; a < p.length; a += 9) {
        // Möller and Trumbore.
        const ux = p[a + 3] - p[a], uy = p[a + 4] - p[a + 1], uz = p[a + 5] - p[a + 2];
        const vx = p[a + 6] - p[a], vy = p[a + 7] - p[a + 1], vz = p[a + 8] - p[a + 2];
        const px = y * vz - z * vy, py = z * vx - x * vz, pz = x * vy - y * vx;
        const determinant = ux * px + uy * py + uz * pz;
        const tx = from[0] - p[a], ty = from[1] - p[a + 1], tz = from[2] - p[a + 2];
        const u = (tx * px + ty * py + tz * pz) / determinant;
        if (!(u >= 0 && u <= 1)) continue;
        const qx = ty * uz - tz * uy, qy = tz * ux - tx * uz, qz = tx * uy - ty * ux;
        const v = (x * qx + y * qy + z * qz) / determinant;
        const distance = (vx * qx + vy * qy + vz * qz) / determinant;
        if (v >= 0 && u + v <= 1 && distance > 0 && distance < nearest) nearest = distance;
      }
    }
    return nearest < most ? nearest : undefined;
  }

  /** Bodies that a ray from the eye straight up leaves more often than it enters, as `medium.wgsl` has them: 16 bits each,
   * the one first that is left first. */
  media([x, y, z]) {
    const within = [];
    for (const { object, isBody, places: p, low, high } of this.shapes) {
      if (!isBody || [x, y, z].some((place, axis) => place < low[axis] || place > high[axis])) continue;
      let leaves = 0, nearest = Infinity;
      for (let a = 0; a < p.length; a += 9) {
        // Twice the areas, seen from below, of the triangles that the eye makes with each side.
        const area = (i, j) => (p[j] - x) * (p[i + 2] - z) - (p[i] - x) * (p[j + 2] - z);
        const [ab, bc, ca] = [area(a, a + 3), area(a + 3, a + 6), area(a + 6, a)];
        const all = ab + bc + ca;
        if (all === 0 || [ab, bc, ca].some((part) => part / all < 0)) continue;
        const height = (bc * p[a + 1] + ca * p[a + 4] + ab * p[a + 7]) / all - y;
        if (height <= 0) continue;
        leaves += Math.sign(all);
        if (all > 0) nearest = Math.min(nearest, height);
      }
      if (leaves > 0) within.push({ object, nearest });
    }
    const words = new Uint32Array(4);
    within.sort((a, b) => a.nearest - b.nearest);
    within.slice(0, 8).forEach(({ object }, place) => { words[place >> 1] |= (object + 1) << (16 * (place & 1)); });
    return words;
  }

  /** What chains are traced through, in local coordinates: triangles with their corners and the numbers of their order, nodes
   * with their boxes. */
  hierarchy() {
    const { contents, Triangle, Node, local: { centre_m: centre, per_m: perM, first_mesh_node: firstNode } } = this.scene;
    const triangles = contents.triangles.slice(), nodes = contents.nodes.slice(), corner = new Float64Array(3);
    const words = new Uint32Array(triangles.buffer), floats = new Float32Array(triangles.buffer);
    const [a, b, c, owner, index, rank] = ["a", "b", "c", "object", "first_index", "order"].map((name) => Triangle.fields[name] / 4);
    for (let at = 0; at < words.length; at += Triangle.size / 4) {
      if (words[at + owner] === NO_OBJECT) continue;
      words[at + rank] = ((words[at + rank] + words[at + index]) >>> 0) / 3;
      for (const [which, field] of [a, b, c].entries()) {
        this.place(words[at + owner], words[at + index] + which, corner, 0);
        for (let axis = 0; axis < 3; axis += 1) floats[at + field + axis] = (corner[axis] - centre[axis]) * perM;
      }
    }
    const links = new Uint32Array(nodes.buffer), boxes = new Float32Array(nodes.buffer);
    const [low, first, high, count] = ["low", "first", "high", "count"].map((name) => Node.fields[name] / 4), size = Node.size / 4;
    // Parents before children: the roots of meshes, which are nobody's child, then what follows from them.
    const children = (node) => (links[node * size + count] ? [] : [links[node * size + first], links[node * size + first] + 1]);
    const meshNodes = Array.from({ length: links.length / size - firstNode }, (_, node) => firstNode + node);
    const inner = new Set(meshNodes.flatMap(children)), order = meshNodes.filter((node) => !inner.has(node));
    for (let next = 0; next < order.length; next += 1) order.push(...children(order[next]));
    for (const at of order.reverse().map((node) => node * size)) {
      const isLeaf = links[at + count] > 0, step = isLeaf ? Triangle.size / 4 : size, begin = links[at + first] * step;
      const end = begin + step * (isLeaf ? links[at + count] : 2), from = isLeaf ? floats : boxes;
      const fields = isLeaf ? [a, b, c] : [low, high];
      for (let axis = 0; axis < 3; axis += 1) {
        let least = Infinity, most = -Infinity;
        for (let part = begin + axis; part < end; part += step) {
          for (const field of fields) {
            least = Math.min(least, from[part + field]);
            most = Math.max(most, from[part + field]);
          }
        }
        [boxes[at + low + axis], boxes[at + high + axis]] = [least, most];
      }
    }
    return { triangles, nodes };
  }
}
