// One file that holds all others: scripts get names by an import map, everything else is handed out as it is.
(async () => {
  const packed = (name) => document.querySelector(`[data-file="${name}"]`).textContent;
  globalThis.packedFile = (name) => Uint8Array.from(atob(packed(name)), (letter) => letter.charCodeAt(0));
  const imports = {};
  for (const { dataset: { file: name } } of document.querySelectorAll('[data-file^="module:"]')) {
    const code = new Blob([packedFile(name)]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = new Blob([await new Response(code).arrayBuffer()], { type: "text/javascript" });
    imports[name.slice("module:".length)] = URL.createObjectURL(script);
  }
  for (const [type, text] of [["importmap", JSON.stringify({ imports })], ["module", 'import "page";']]) {
    document.head.append(Object.assign(document.createElement("script"), { type, textContent: text }));
  }
})();
