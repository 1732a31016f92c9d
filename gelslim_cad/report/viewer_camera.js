// A turntable camera (z stays up) with parallel or perspective projection. Lengths in mm.

const LENS = Math.tan((20 * Math.PI) / 360);  // half of the perspective field of view
const VIEWS = { iso: [-56, 27], top: [-90, 90], side: [-90, 0], tip: [0, 0], below: [-56, -30] };

function multiply(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++)
    for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

class Camera {
  constructor() {
    [this.yaw, this.pitch] = VIEWS.iso;
    this.target = [0, 0, 0];
    this.height = 50;  // half of what the picture shows, at the target
    this.perspective = true;
    this.reach = 100;  // radius of the scene about the target, for the depth range
  }

  axes() {
    const [y, p] = [(this.yaw * Math.PI) / 180, (this.pitch * Math.PI) / 180];
    return {
      right: [-Math.sin(y), Math.cos(y), 0],
      up: [-Math.sin(p) * Math.cos(y), -Math.sin(p) * Math.sin(y), Math.cos(p)],
      back: [Math.cos(p) * Math.cos(y), Math.cos(p) * Math.sin(y), Math.sin(p)],
    };
  }

  distance() {
    return this.perspective ? this.height / LENS : 2 * this.reach;
  }

  eye() {
    const { back } = this.axes(), d = this.distance();
    return this.perspective ? [...this.target.map((t, k) => t + d * back[k]), 1] : [...back, 0];
  }

  matrix(aspect) {
    const { right, up, back } = this.axes(), d = this.distance(), t = this.target;
    const near = this.perspective ? Math.max(d - this.reach, d * 0.02) : d - this.reach;
    const far = d + this.reach, h = this.height;
    const view = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot3(right, t), -dot3(up, t), -dot3(back, t) - d, 1];
    const lens = this.perspective
      ? [1 / (LENS * aspect), 0, 0, 0, 0, 1 / LENS, 0, 0, 0, 0, -(far + near) / (far - near), -1,
        0, 0, (-2 * far * near) / (far - near), 0]
      : [1 / (h * aspect), 0, 0, 0, 0, 1 / h, 0, 0, 0, 0, -2 / (far - near), 0,
        0, 0, -(far + near) / (far - near), 1];
    return multiply(lens, view);
  }

  // Maps one pixel (clip coordinates x, y; size in clip units) onto the whole clip space.
  pickMatrix(aspect, x, y, width, height) {
    const [sx, sy] = [2 / width, 2 / height];
    return multiply([sx, 0, 0, 0, 0, sy, 0, 0, 0, 0, 1, 0, -x * sx, -y * sy, 0, 1], this.matrix(aspect));
  }

  // Key light from above the viewer's left shoulder.
  key() {
    const { right, up, back } = this.axes();
    const v = [0, 1, 2].map((k) => -0.45 * right[k] + 0.65 * up[k] + 0.62 * back[k]);
    return v.map((value) => value / Math.hypot(...v));
  }

  look(view) {
    [this.yaw, this.pitch] = VIEWS[view];
  }

  orbit(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.max(-90, Math.min(90, this.pitch + dy));
  }

  pan(dx, dy) {
    const { right, up } = this.axes();
    this.target = this.target.map((t, k) => t - dx * right[k] + dy * up[k]);
  }

  zoom(factor, limit) {
    this.height = Math.max(limit / 400, Math.min(limit * 5, this.height * factor));
  }

  // Frames the corner points; leaves a margin for labels.
  fit(points, aspect) {
    const { right, up, back } = this.axes(), frame = [right, up, back];
    const span = frame.map((axis) => points.reduce(
      ([low, high], p) => [Math.min(low, dot3(axis, p)), Math.max(high, dot3(axis, p))],
      [Infinity, -Infinity]));
    const mid = span.map(([low, high]) => (low + high) / 2);
    const half = span.map(([low, high]) => (high - low) / 2);
    this.target = [0, 1, 2].map((k) => mid[0] * right[k] + mid[1] * up[k] + mid[2] * back[k]);
    const need = Math.max(half[1], half[0] / aspect) * 1.1;
    this.height = need + (this.perspective ? half[2] * LENS : 0);
    this.widen(points);
  }

  widen(points) {
    this.reach = 1.05 * Math.max(1, ...points.map((p) => Math.hypot(...p.map((v, k) => v - this.target[k]))));
  }
}
