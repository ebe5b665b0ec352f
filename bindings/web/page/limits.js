/* What a run needs, so that a mesh too large for the tab is refused before it takes the tab with it. */

const MEGABYTE = 2 ** 20;
/* Measured: the library's peak is at most 400 bytes a triangle of the input and 4,500 a quad of the result. The page holds the surface twice
 * beside it (Worker, picture), some 250 bytes a triangle. */
const PER_TRIANGLE = 400, PER_QUAD = 4500, PER_TRIANGLE_SHOWN = 250, FIXED = 32 * MEGABYTE;
const PER_BYTE_OF_FILE = 4; // the bytes, the text in the module, and what is made of it
const MOST = 3584 * MEGABYTE; // of the 4 GiB that the module can address
const UNKNOWN = 2048 * MEGABYTE; // where the browser does not say what the machine has

/* Bytes that this tab may use. ?memory=MB sets it for trials. */
export function memoryOfTab() {
  const asked = Number(new URLSearchParams(location.search).get('memory'));
  if (asked > 0) return asked * MEGABYTE;
  return navigator.deviceMemory ? Math.min(MOST, (navigator.deviceMemory * 1024 * MEGABYTE) / 2) : UNKNOWN;
}

export const memoryOfRun = (triangles, quads) => FIXED + (PER_TRIANGLE + PER_TRIANGLE_SHOWN) * triangles + PER_QUAD * quads;
export const memoryOfFile = (bytes) => FIXED + PER_BYTE_OF_FILE * bytes;

const inWords = (bytes) => (bytes >= 1024 * MEGABYTE ? `${(bytes / 1024 / MEGABYTE).toFixed(1)} GB` : `${Math.ceil(bytes / MEGABYTE)} MB`);

/* The sentence for what is too large, or null. */
export function refusal(what, needed, command) {
  const limit = memoryOfTab();
  if (needed <= limit) return null;
  return `${what} needs about ${inWords(needed)} of memory, and this tab may use ${inWords(limit)}; the command line has no such limit: ${command}`;
}
