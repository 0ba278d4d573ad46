// Texts that come into the editor and leave it: files in UTF-8 and UTF-16, what is pasted, downloads.
const BOMS = [[[0xff, 0xfe], "utf-16le"], [[0xfe, 0xff], "utf-16be"]];

export function decode(bytes) {
  const [, encoding] = BOMS.find(([bom]) => bom.every((one, i) => bytes[i] === one)) ?? [null, "utf-8"];
  try {
    return new TextDecoder(encoding, { fatal: true }).decode(bytes);
  } catch {
    throw new Error(`This file cannot be read as text in ${encoding.toUpperCase()}. Save it as UTF-8.`);
  }
}

export function save(text, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  link.download = `${name.replace(/[^\p{L}\p{N}_-]+/gu, "-")}.txt`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

// Open what is pasted anywhere but into a field.
export function listen(target, open) {
  target.addEventListener("paste", (event) => {
    if (event.target.closest("input, textarea, select")) return;
    const text = event.clipboardData.getData("text/plain");
    if (!text.trim()) return;
    event.preventDefault();
    open(text);
  });
}
