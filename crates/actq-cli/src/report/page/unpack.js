// Data of a page: base64, gzip, and the weights of a policy in f32.
const bytes = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
const words = (base64, Type) => new Type(bytes(base64).buffer);
async function unpacked(base64) {
  return new Uint8Array(await new Response(new Blob([bytes(base64)]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer());
}
function weightsOf({ shapes, bits, weights }) {
  if (bits === 32) return words(weights, Float32Array);
  const buffer = bytes(weights).buffer;
  const count = shapes.reduce((sum, [rows, cols]) => sum + rows * cols, 0);
  const levels = new Int16Array(buffer, 0, count);
  const scales = new Float32Array(buffer, 4 * Math.ceil(count / 2));
  const all = new Float32Array(count);
  let [at, row] = [0, 0];
  for (const [rows, cols] of shapes) for (let r = 0; r < rows; r++, row++) for (let c = 0; c < cols; c++, at++) all[at] = levels[at] * scales[row];
  return all;
}
