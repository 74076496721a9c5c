// The files of the page: beside it, or in it; and what is in the file of a moment.

/** Bytes of a file, unpacked; `came(share)` is told how much of it is there. */
export async function read(name, came = () => {}) {
  const answer = globalThis.packedFile ? new Response(packedFile(name)) : await fetch(name);
  if (!answer.ok) throw new Error(`${name} is not there (${answer.status})`);
  const length = Number(answer.headers.get("content-length")) || Infinity;
  let count = 0;
  const counted = new TransformStream({ transform(chunk, out) {
    came((count += chunk.length) / length);
    out.enqueue(chunk);
  } });
  const bytes = await whole(answer.body.pipeThrough(counted));
  // Servers may have unpacked it.
  if (bytes[0] !== 0x1f || bytes[1] !== 0x8b) return bytes;
  return whole(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
}

const whole = async (stream) => new Uint8Array(await new Response(stream).arrayBuffer());

/** The description in the file of a moment, with its contents by name; `first` has what is the same at the first one. */
export function opened(file, first) {
  const length = new DataView(file.buffer, file.byteOffset).getUint32(0, true);
  const scene = JSON.parse(new TextDecoder().decode(file.subarray(4, 4 + length)));
  const contents = { ...first?.contents };
  for (const [name, [start, bytes, record]] of Object.entries(scene.contents)) {
    const stored = file.subarray(4 + length + start, 4 + length + start + bytes);
    contents[name] = record ? unfiltered(stored, record, first?.contents[name]) : stored;
  }
  return { ...scene, programs: first?.programs ?? scene.programs, contents };
}

// Undoes what `filtered` of the exporter did: bytes of a record lie with those of the others, words are differences from
// the record before, and all of it from the first moment.
function unfiltered(stored, record, first) {
  const across = record / 4;
  const bytes = new Uint8Array(stored.length), words = new Uint32Array(bytes.buffer);
  for (let plane = 0, at = 0; plane < record; plane += 1) {
    for (let place = plane; place < bytes.length; place += record) bytes[place] = stored[at++];
  }
  for (let word = across; word < words.length; word += 1) words[word] += words[word - across];
  if (first) new Uint32Array(first.buffer).subarray(0, words.length).forEach((was, word) => { words[word] += was; });
  return bytes;
}
