/** Loads the files of the page. */

const GZIP = [0x1f, 0x8b];

/** Return the bytes of a file next to the page. Compressed files are decompressed. */
export async function loadBytes(name) {
  let response;
  try {
    response = await fetch(name);
  } catch (error) {
    throw new Error(`The file ${name} could not be loaded: ${error.message}.`);
  }
  if (!response.ok) throw new Error(`The file ${name} could not be loaded: the server answered ${response.status}.`);
  const bytes = new Uint8Array(await response.arrayBuffer());
  if (!GZIP.every((byte, i) => bytes[i] === byte)) return bytes; // the server or the browser has decompressed it
  if (typeof DecompressionStream === "undefined") throw new Error("This browser is too old: it cannot decompress files.");
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

export async function loadText(name) {
  return new TextDecoder().decode(await loadBytes(name));
}
