// One file that holds all others: scripts get names by an import map, everything else is handed out as it is.
(async () => {
  const elements = new Map();
  for (const element of document.querySelectorAll("script[data-file]")) elements.set(element.dataset.file, element);
  const bytes = (name) => Uint8Array.from(atob(elements.get(name).textContent), (letter) => letter.charCodeAt(0));
  globalThis.packedFile = bytes;
  const imports = {};
  for (const name of elements.keys()) {
    if (!name.startsWith("module:")) continue;
    const code = new Blob([bytes(name)]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = new Blob([await new Response(code).arrayBuffer()], { type: "text/javascript" });
    imports[name.slice("module:".length)] = URL.createObjectURL(script);
  }
  for (const [type, text] of [["importmap", JSON.stringify({ imports })], ["module", 'import "page";']]) {
    document.head.append(Object.assign(document.createElement("script"), { type, textContent: text }));
  }
})();
