// Reads a GLB (glTF 2.0 binary) into parts. Lengths become mm. Positions stay in the frame of
// the mesh nodes (the sensor frame, z out of the gel): a parent that only turns the scene for
// y-up programs is left out of account.

const COMPONENT = { 5120: Int8Array, 5121: Uint8Array, 5122: Int16Array, 5123: Uint16Array,
  5125: Uint32Array, 5126: Float32Array };
const WIDTH = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

function decodeBase64(text) {
  const raw = atob(text.trim());
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes.buffer;
}

function splitGlb(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 20 || view.getUint32(0, true) !== 0x46546c67) throw Error("not a GLB");
  let json = null, binary = null;
  for (let at = 12; at + 8 <= buffer.byteLength;) {
    const length = view.getUint32(at, true), kind = view.getUint32(at + 4, true);
    if (kind === 0x4e4f534a) json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, at + 8, length)));
    else if (kind === 0x004e4942) binary = at + 8;
    at += 8 + length;
  }
  if (!json || binary === null) throw Error("GLB without its JSON or BIN chunk");
  return { json, binary };
}

function readAccessor(buffer, binary, json, index) {
  const accessor = json.accessors[index], width = WIDTH[accessor.type];
  const view = json.bufferViews[accessor.bufferView], Kind = COMPONENT[accessor.componentType];
  const start = binary + (view.byteOffset || 0) + (accessor.byteOffset || 0);
  const step = view.byteStride || width * Kind.BYTES_PER_ELEMENT;
  const bytes = width * Kind.BYTES_PER_ELEMENT;
  if (step === bytes) return new Kind(buffer.slice(start, start + accessor.count * bytes));
  const out = new Kind(accessor.count * width);
  for (let i = 0; i < accessor.count; i++)
    out.set(new Kind(buffer.slice(start + i * step, start + i * step + bytes)), i * width);
  return out;
}

function nodeTransform(node) {
  if (node.matrix) return node.matrix;
  const [x, y, z, w] = node.rotation || [0, 0, 0, 1], s = node.scale || [1, 1, 1];
  const t = node.translation || [0, 0, 0];
  return [
    (1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y + z * w) * s[0], 2 * (x * z - y * w) * s[0], 0,
    2 * (x * y - z * w) * s[1], (1 - 2 * (x * x + z * z)) * s[1], 2 * (y * z + x * w) * s[1], 0,
    2 * (x * z + y * w) * s[2], 2 * (y * z - x * w) * s[2], (1 - 2 * (x * x + y * y)) * s[2], 0,
    t[0], t[1], t[2], 1];
}

function transformed(m, vectors, weight, scale) {
  const out = new Float32Array(vectors.length);
  for (let i = 0; i < vectors.length; i += 3) {
    const [x, y, z] = [vectors[i], vectors[i + 1], vectors[i + 2]];
    for (let k = 0; k < 3; k++)
      out[i + k] = scale * (m[k] * x + m[4 + k] * y + m[8 + k] * z + weight * m[12 + k]);
  }
  return out;
}

function parseGlb(buffer) {
  const { json, binary } = splitGlb(buffer), parts = [];
  for (const node of json.nodes || []) {
    if (node.mesh === undefined) continue;
    const mesh = json.meshes[node.mesh], matrix = nodeTransform(node);
    for (const primitive of mesh.primitives) {
      if ((primitive.mode ?? 4) !== 4) continue;
      const read = (i) => readAccessor(buffer, binary, json, i);
      const positions = transformed(matrix, read(primitive.attributes.POSITION), 1, 1000);
      const indices = primitive.indices === undefined
        ? Uint32Array.from({ length: positions.length / 3 }, (_, i) => i)
        : Uint32Array.from(read(primitive.indices));
      const normals = primitive.attributes.NORMAL === undefined
        ? null : transformed(matrix, read(primitive.attributes.NORMAL), 0, 1);
      const material = (json.materials || [])[primitive.material] || {};
      const colour = material.pbrMetallicRoughness?.baseColorFactor || [0.6, 0.6, 0.6, 1];
      const extras = node.extras || {};
      parts.push({ name: node.name || mesh.name || `part ${parts.length + 1}`, positions, indices,
        normals, colour, explode: extras.explode_mm || [0, 0, 0], box: boxOf(positions) });
    }
  }
  if (!parts.length) throw Error("the GLB holds no mesh");
  return parts;
}

function boxOf(positions) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; i++) {
    if (positions[i] < low[i % 3]) low[i % 3] = positions[i];
    if (positions[i] > high[i % 3]) high[i % 3] = positions[i];
  }
  return { low, high };
}

// Gives every vertex the number of its place, so that faces tessellated apart share their rim.
function weld(positions) {
  const count = positions.length / 3, size = 1 << Math.ceil(Math.log2(count * 2 + 2));
  const table = new Int32Array(size).fill(-1), place = new Uint32Array(count);
  const q = Int32Array.from(positions, (value) => Math.round(value * 5000));  // 0.2 um
  for (let i = 0; i < count; i++) {
    const [x, y, z] = [q[3 * i], q[3 * i + 1], q[3 * i + 2]];
    let h = (Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791)) >>> 0;
    for (h ^= h >>> 15; ; h++) {
      const j = table[h & (size - 1)];
      if (j < 0) { table[h & (size - 1)] = i; place[i] = i; break; }
      if (q[3 * j] === x && q[3 * j + 1] === y && q[3 * j + 2] === z) { place[i] = j; break; }
    }
  }
  return place;
}

function faceNormals({ positions: p, indices }) {
  const out = new Float32Array(indices.length);
  for (let t = 0; t < indices.length; t += 3) {
    const [a, b, c] = [3 * indices[t], 3 * indices[t + 1], 3 * indices[t + 2]];
    const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(...n) || 1;
    for (let k = 0; k < 3; k++) out[t + k] = n[k] / length;
  }
  return out;
}

// Line segments where two faces meet at more than `degrees`, or where a face has no neighbour.
function creaseEdges(part, degrees = 24) {
  const { positions, indices } = part, place = weld(positions), normals = faceNormals(part);
  const limit = Math.cos((degrees * Math.PI) / 180), open = new Map(), lines = [];
  const count = positions.length / 3;
  const add = (a, b) => lines.push(...positions.subarray(3 * a, 3 * a + 3),
    ...positions.subarray(3 * b, 3 * b + 3));
  for (let t = 0; t < indices.length; t += 3) {
    for (let k = 0; k < 3; k++) {
      const a = place[indices[t + k]], b = place[indices[t + ((k + 1) % 3)]];
      if (a === b) continue;
      const key = a < b ? a * count + b : b * count + a, other = open.get(key);
      if (other === undefined) { open.set(key, t); continue; }
      open.delete(key);
      const dot = normals[t] * normals[other] + normals[t + 1] * normals[other + 1]
        + normals[t + 2] * normals[other + 2];
      if (dot < limit) add(a, b);
    }
  }
  for (const key of open.keys()) add(Math.floor(key / count), key % count);
  return Float32Array.from(lines);
}

// A mesh whose stored normals were averaged over sharp edges looks like a cushion: say so.
function normalsAreSharp(part) {
  if (!part.normals) return false;
  const faces = faceNormals(part), { indices, normals } = part;
  let bad = 0;
  for (let i = 0; i < indices.length; i++) {
    const f = i - (i % 3), n = 3 * indices[i];
    const dot = faces[f] * normals[n] + faces[f + 1] * normals[n + 1] + faces[f + 2] * normals[n + 2];
    if (dot < 0.8 && Math.abs(faces[f]) + Math.abs(faces[f + 1]) + Math.abs(faces[f + 2]) > 0.5) bad++;
  }
  return bad * 50 < indices.length;
}

// Segments in which the plane axis = at cuts the part.
function sectionLines({ positions: p, indices }, axis, at) {
  const out = [];
  for (let t = 0; t < indices.length; t += 3) {
    const hit = [];
    for (let k = 0; k < 3; k++) {
      const a = 3 * indices[t + k], b = 3 * indices[t + ((k + 1) % 3)];
      const da = p[a + axis] - at, db = p[b + axis] - at;
      if (da < 0 === db < 0) continue;
      const s = da / (da - db);
      hit.push(p[a] + s * (p[b] - p[a]), p[a + 1] + s * (p[b + 1] - p[a + 1]),
        p[a + 2] + s * (p[b + 2] - p[a + 2]));
    }
    if (hit.length === 6) out.push(...hit);
  }
  return Float32Array.from(out);
}
