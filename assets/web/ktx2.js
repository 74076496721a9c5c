// KTX 2.0 files of shared exponents (RGB9E5) with zstd, as the program writes them.

import { ZSTDDecoder } from "zstddec";

const RGB9E5 = 123, ZSTD = 2;
const zstd = new ZSTDDecoder();

/** {width, height, levels: [Uint32Array]}: the level of the file, and those that follow from it. */
export async function ktx2(bytes) {
  await zstd.init();
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const word = (at) => view.getUint32(at, true);
  if (word(12) !== RGB9E5 || word(44) !== ZSTD) throw new Error("a map has a format that this page does not read");
  const [offset, length, whole] = [80, 88, 96].map((field) => Number(view.getBigUint64(field, true)));
  const unpacked = zstd.decode(bytes.subarray(offset, offset + length), whole);
  let [width, height] = [word(20), word(24)];
  const made = { width, height, levels: [new Uint32Array(unpacked.buffer, unpacked.byteOffset, whole / 4)] };
  while (width > 1 || height > 1) {
    made.levels.push(halved(made.levels.at(-1), width, height));
    [width, height] = [width, height].map((side) => Math.max(side >> 1, 1));
  }
  return made;
}

// Values of a step of the mantissa, by exponent.
const STEPS = Float64Array.from({ length: 32 }, (_, exponent) => 2 ** (exponent - 24));

/** Means of 2 × 2 texels; an odd last row or column is left out. */
function halved(fine, width, height) {
  const [across, down] = [width, height].map((side) => Math.max(side >> 1, 1));
  const coarse = new Uint32Array(across * down);
  const right = width > 1 ? 1 : 0, below = height > 1 ? width : 0;
  for (let y = 0, at = 0; y < down; y++) {
    for (let x = 0; x < across; x++, at++) {
      const first = 2 * y * width + 2 * x;
      const a = fine[first], b = fine[first + right], c = fine[first + below], d = fine[first + right + below];
      if (a === b && a === c && a === d) { coarse[at] = a; continue; }
      const i = STEPS[a >>> 27], j = STEPS[b >>> 27], k = STEPS[c >>> 27], l = STEPS[d >>> 27];
      const red = (a & 511) * i + (b & 511) * j + (c & 511) * k + (d & 511) * l;
      const green = (a >>> 9 & 511) * i + (b >>> 9 & 511) * j + (c >>> 9 & 511) * k + (d >>> 9 & 511) * l;
      const blue = (a >>> 18 & 511) * i + (b >>> 18 & 511) * j + (c >>> 18 & 511) * k + (d >>> 18 & 511) * l;
      // The largest exponent is enough: a mean is no larger than its parts. A smaller one is finer.
      const most = Math.max(red, green, blue) / 4;
      let exponent = Math.max(a >>> 27, b >>> 27, c >>> 27, d >>> 27);
      while (exponent > 0 && most <= 511 * STEPS[exponent - 1]) exponent--;
      const step = 4 * STEPS[exponent];
      coarse[at] = exponent << 27 | Math.round(blue / step) << 18 | Math.round(green / step) << 9 | Math.round(red / step);
    }
  }
  return coarse;
}
