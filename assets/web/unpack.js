// One file that holds all others: scripts get names by an import map, everything else is unpacked when it is asked for.
(async () => {
  const unpacked = async (element) => {
    const bytes = Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0));
    if (!("gzip" in element.dataset)) return bytes;
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };
  const elements = new Map();
  for (const element of document.querySelectorAll("script[data-file]")) elements.set(element.dataset.file, element);
  globalThis.packedFile = (name) => unpacked(elements.get(name));
  const imports = {};
  for (const [file, element] of elements) {
    if (!file.startsWith("module:")) continue;
    const code = new Blob([await unpacked(element)], { type: "text/javascript" });
    imports[file.slice("module:".length)] = URL.createObjectURL(code);
  }
  for (const [type, text] of [["importmap", JSON.stringify({ imports })], ["module", 'import "page";']]) {
    const script = Object.assign(document.createElement("script"), { type, textContent: text });
    document.head.append(script);
  }
})();
