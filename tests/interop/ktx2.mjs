// KTX 2.0 files by ktx-parse and zstddec: prints one line of JSON for each, with the values of its first level where they
// share exponents.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const require = createRequire(pathToFileURL(`${process.cwd()}/`));
const load = (name) => import(pathToFileURL(require.resolve(name)));
const { read } = await load("ktx-parse");
const { ZSTDDecoder } = await load("zstddec");
const RGB9E5 = 123;
const zstd = new ZSTDDecoder();
await zstd.init();

function sharedExponents(bytes) {
  const words = new Uint32Array(bytes.slice().buffer);
  return Array.from(words).flatMap((word) => {
    const step = 2 ** ((word >>> 27) - 24);
    return [0, 9, 18].map((first) => ((word >>> first) & 511) * step);
  });
}

for (const file of process.argv.slice(2)) {
  const container = read(new Uint8Array(readFileSync(file)));
  const levels = container.levels.map((level) => {
    const bytes = zstd.decode(level.levelData, level.uncompressedByteLength);
    if (bytes.length !== level.uncompressedByteLength) throw new Error(`${file}: a level of ${bytes.length} bytes`);
    return bytes;
  });
  const { vkFormat, typeSize, pixelWidth, pixelHeight, supercompressionScheme, keyValue } = container;
  const [descriptor] = container.dataFormatDescriptor;
  const values = vkFormat === RGB9E5 ? sharedExponents(levels[0]) : [];
  const text = Object.fromEntries(Object.entries(keyValue).map(([key, value]) => [key, String(value)]));
  console.log(JSON.stringify({ vkFormat, typeSize, pixelWidth, pixelHeight, supercompressionScheme, text, values,
    levels: levels.length, model: descriptor.colorModel, samples: descriptor.samples.length }));
}
