// Draws parts with WebGL 2: lit faces, crease edges, and a section whose cut solids are capped
// (stencil count of back minus front faces) and hatched. A part that is `open`, such as the camera's
// view, has no inside: it is drawn whole.

const FACE_VERTEX = `#version 300 es
layout(location=0) in vec3 place; layout(location=1) in vec3 normal;
uniform mat4 camera; uniform vec3 shift; out vec3 world; out vec3 n;
void main() { world = place + shift; n = normal; gl_Position = camera * vec4(world, 1.0); }`;

const FACE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 world; in vec3 n; out vec4 paint;
uniform vec4 colour, tint, eye, plane; uniform vec3 key; uniform float flatShade;
void main() {
  if (dot(plane.xyz, world) > plane.w) discard;
  vec3 facing = cross(dFdx(world), dFdy(world));
  vec3 view = normalize(eye.xyz - eye.w * world);
  vec3 m = normalize(flatShade > 0.5 || dot(n, n) < 0.1 ? facing : n);
  if (dot(m, view) < 0.0 && (flatShade > 0.5 || !gl_FrontFacing)) m = -m;
  vec3 base = mix(colour.rgb, tint.rgb, tint.a);
  vec3 sky = mix(vec3(0.30, 0.29, 0.28), vec3(0.62, 0.65, 0.70), 0.5 + 0.5 * m.z);
  float lit = max(dot(m, key), 0.0), head = max(dot(m, view), 0.0);
  float gloss = pow(max(dot(m, normalize(key + view)), 0.0), 40.0);
  vec3 light = base * (sky * 0.62 + 0.62 * lit + 0.14 * head) + 0.10 * gloss;
  float rim = pow(1.0 - head, 3.0);
  float alpha = colour.a < 0.999 ? min(1.0, colour.a + 0.45 * rim + 0.3 * gloss) : 1.0;
  paint = vec4(pow(min(light, vec3(1.0)), vec3(0.4545)), alpha);
}`;

const LINE_VERTEX = `#version 300 es
layout(location=0) in vec3 place; uniform mat4 camera; uniform vec3 shift; out vec3 world;
void main() { world = place + shift; gl_Position = camera * vec4(world, 1.0); }`;

const LINE_FRAGMENT = `#version 300 es
precision highp float; in vec3 world; out vec4 paint; uniform vec4 colour, plane; uniform float hatch;
void main() {
  if (dot(plane.xyz, world) > plane.w) discard;
  paint = colour;
  if (hatch != 0.0) {
    float stripe = abs(fract((gl_FragCoord.x + sign(hatch) * gl_FragCoord.y) / abs(hatch)) - 0.5);
    paint.rgb = mix(paint.rgb * 0.62, paint.rgb, smoothstep(0.03, 0.13, stripe));
  }
}`;

const OFF = [0, 0, 0, 1];

function buildProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw Error(gl.getProgramInfoLog(program));
  const at = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(program, i);
    at[name] = gl.getUniformLocation(program, name);
  }
  return { program, at };
}

function vertexArray(gl, arrays, indices) {
  const vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  const buffers = arrays.map((array, i) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(i);
    gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 0, 0);
    return buffer;
  });
  if (indices) {
    const buffer = gl.createBuffer();
    buffers.push(buffer);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }
  gl.bindVertexArray(null);
  return { vao, buffers };
}

class Painter {
  constructor(canvas, parts) {
    const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: false });
    if (!gl) throw Error("WebGL 2 is not available");
    this.gl = gl;
    this.face = buildProgram(gl, FACE_VERTEX, FACE_FRAGMENT);
    this.line = buildProgram(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.items = parts.map((part) => this.upload(part));
    this.quad = vertexArray(gl, [new Float32Array(12)]);
    this.pickTarget = this.makePickTarget();
  }

  upload(part) {
    const edges = creaseEdges(part), sharp = normalsAreSharp(part);
    const blank = new Float32Array(part.positions.length);
    return { part, edges: edges.length / 3, sharp, cut: null, cutKey: "",
      mesh: vertexArray(this.gl, [part.positions, part.normals || blank], part.indices),
      lines: vertexArray(this.gl, [edges]), cutLines: vertexArray(this.gl, [new Float32Array(6)]) };
  }

  // Give back what the parts take on the graphics card.
  free() {
    const { gl } = this;
    for (const { mesh, lines, cutLines } of this.items)
      for (const { vao, buffers } of [mesh, lines, cutLines]) {
        gl.deleteVertexArray(vao);
        buffers.forEach((buffer) => gl.deleteBuffer(buffer));
      }
    for (const { program } of [this.face, this.line]) gl.deleteProgram(program);
  }

  makePickTarget() {
    const { gl } = this, frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    for (const [slot, format] of [[gl.COLOR_ATTACHMENT0, gl.RGBA8], [gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT16]]) {
      const store = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, store);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, 1, 1);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, slot, gl.RENDERBUFFER, store);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return frame;
  }

  use({ program, at }, values) {
    const { gl } = this;
    gl.useProgram(program);
    for (const [name, value] of Object.entries(values)) {
      if (at[name] === undefined) continue;
      if (typeof value === "number") gl.uniform1f(at[name], value);
      else if (value.length === 16) gl.uniformMatrix4fv(at[name], false, value);
      else if (value.length === 4) gl.uniform4fv(at[name], value);
      else gl.uniform3fv(at[name], value);
    }
  }

  triangles({ mesh, part }) {
    this.gl.bindVertexArray(mesh.vao);
    this.gl.drawElements(this.gl.TRIANGLES, part.indices.length, this.gl.UNSIGNED_INT, 0);
    return part.indices.length / 3;
  }

  segments(vao, count) {
    this.gl.bindVertexArray(vao);
    this.gl.drawArrays(this.gl.LINES, 0, count);
  }

  // scene: camera (matrix), eye, key, plane or null, section {axis, at}, background, shift(part),
  // visible(part), tint(part), edge colour. Returns the number of triangles drawn.
  draw(scene) {
    const { gl } = this;
    if (gl.isContextLost()) return 0;
    const plane = scene.plane || OFF;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(...scene.background, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.depthFunc(gl.LEQUAL);
    this.use(this.face, { camera: scene.camera, eye: scene.eye, key: scene.key, plane });
    this.use(this.line, { camera: scene.camera, plane });
    const shown = this.items.filter(({ part }) => scene.visible(part));
    const solid = shown.filter(({ part }) => part.colour[3] >= 0.999);
    const clear = shown.filter(({ part }) => part.colour[3] < 0.999)
      .sort((a, b) => scene.depth(a.part) - scene.depth(b.part));
    let count = 0;
    gl.disable(gl.BLEND);
    for (const item of solid) count += this.faces(item, scene, false);
    for (const item of solid) this.cap(item, scene, 1);
    for (const item of solid) this.edges(item, scene, 0.72);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    for (const item of clear) {
      count += this.faces(item, scene, true);
      this.cap(item, scene, 0.8);
      this.edges(item, scene, 0.5);
    }
    return count;
  }

  faces(item, scene, bothSides) {
    const { gl } = this, { part } = item;
    this.use(this.face, { shift: scene.shift(part), colour: part.colour, tint: scene.tint(part),
      flatShade: item.sharp ? 0 : 1, plane: (!part.open && scene.plane) || OFF });
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.depthMask(!bothSides);
    if (bothSides) {
      gl.enable(gl.CULL_FACE);
      gl.cullFace(gl.FRONT);
      this.triangles(item);
      gl.cullFace(gl.BACK);
    }
    const count = this.triangles(item);
    gl.disable(gl.CULL_FACE);
    gl.depthMask(true);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    return count;
  }

  edges(item, scene, strength) {
    const { gl } = this, { part } = item, bright = scene.tint(part)[3] > 0;
    if (part.open && !bright) return;
    const ink = bright ? scene.accent : part.colour.slice(0, 3).map((v) => Math.min(0.32, 0.28 * v));
    this.use(this.line, { shift: scene.shift(part), colour: [...ink, bright ? 1 : strength], hatch: 0,
      plane: (!part.open && scene.plane) || OFF });
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.segments(item.lines.vao, item.edges);
    if (scene.plane && item.cut) {
      this.use(this.line, { plane: OFF, colour: [0.05, 0.06, 0.08, 1] });
      this.segments(item.cutLines.vao, item.cut);
      this.use(this.line, { plane: scene.plane });
    }
  }

  cap(item, scene, alpha) {
    const { gl } = this, { part } = item;
    item.cut = 0;
    if (!scene.plane || part.open) return;
    const { axis, at } = scene.section, shift = scene.shift(part), local = at - shift[axis];
    if (local <= part.box.low[axis] || local >= part.box.high[axis]) return;
    this.cutContour(item, axis, local);
    gl.clear(gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.ALWAYS, 0, 0xff);
    gl.stencilOpSeparate(gl.FRONT, gl.KEEP, gl.KEEP, gl.DECR_WRAP);
    gl.stencilOpSeparate(gl.BACK, gl.KEEP, gl.KEEP, gl.INCR_WRAP);
    gl.colorMask(false, false, false, false);
    gl.depthMask(false);
    gl.disable(gl.DEPTH_TEST);
    this.use(this.face, { shift, colour: part.colour });
    this.triangles(item);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.colorMask(true, true, true, true);
    gl.stencilFunc(gl.NOTEQUAL, 0, 0xff);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
    const tint = scene.tint(part), colour = part.colour.slice(0, 3)
      .map((v, k) => Math.pow(Math.min(1, 0.10 + 0.9 * (v + (tint[k] - v) * tint[3])), 0.4545));
    this.use(this.line, { shift, colour: [...colour, alpha], plane: OFF,
      hatch: (this.items.indexOf(item) % 2 ? -1 : 1) * scene.hatch });
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    this.square(part.box, axis, local);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    this.use(this.line, { plane: scene.plane });
    gl.disable(gl.STENCIL_TEST);
  }

  square({ low, high }, axis, at) {
    const { gl } = this, [u, v] = [(axis + 1) % 3, (axis + 2) % 3], corners = new Float32Array(12);
    [[low, low], [high, low], [low, high], [high, high]].forEach(([a, b], i) => {
      corners[3 * i + axis] = at;
      corners[3 * i + u] = a[u];
      corners[3 * i + v] = b[v];
    });
    gl.bindVertexArray(this.quad.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.quad.buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STREAM_DRAW);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  cutContour(item, axis, at) {
    const { gl } = this, key = `${axis} ${at}`;
    if (item.cutKey !== key) {
      const lines = sectionLines(item.part, axis, at);
      gl.bindVertexArray(null);
      gl.bindBuffer(gl.ARRAY_BUFFER, item.cutLines.buffers[0]);
      gl.bufferData(gl.ARRAY_BUFFER, lines, gl.STREAM_DRAW);
      item.cutKey = key;
      item.cutCount = lines.length / 3;
    }
    item.cut = item.cutCount;
  }

  // The part under the pixel for which `camera` fills the whole clip space, or null.
  pick(scene, camera) {
    const { gl } = this, pixel = new Uint8Array(4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.pickTarget);
    gl.viewport(0, 0, 1, 1);
    gl.clearColor(0, 0, 0, 1);
    gl.disable(gl.BLEND);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.use(this.line, { camera, plane: scene.plane || OFF, hatch: 0 });
    this.items.forEach((item, i) => {
      if (!scene.visible(item.part)) return;
      this.use(this.line, { shift: scene.shift(item.part), colour: [(i + 1) / 255, 0, 0, 1] });
      this.triangles(item);
    });
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return pixel[0] ? this.items[pixel[0] - 1].part : null;
  }
}
