/* The scene in the address bar: packed behind #s=, so that the link is the scene. */

async function through(bytes, stream) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}

export async function packed(scene) {
  const bytes = await through(new TextEncoder().encode(JSON.stringify(scene)), new CompressionStream("deflate-raw"));
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

export async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
  return JSON.parse(new TextDecoder().decode(await through(bytes, new DecompressionStream("deflate-raw"))));
}

/* The scene of the address bar; null if it holds none. Throws for one that cannot be read. */
export async function linked() {
  const text = new URLSearchParams(location.hash.slice(1)).get("s");
  return text ? unpacked(text) : null;
}

let timer = 0;

export function keep(scene) {
  clearTimeout(timer);
  timer = setTimeout(async () => history.replaceState(null, "", "#s=" + await packed(scene)), 250);
}
