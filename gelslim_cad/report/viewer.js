// The viewer's state and controls: orbit, zoom, explode, section, part list, view presets.

const OPTICS = /^(light_guide|gel_pad|mirror|camera|camera_view|printed_dots|led_board_.*|light_(?!guide).*)$/;

class Viewer {
  constructor(root, parts) {
    this.root = root;
    this.parts = parts;
    this.canvas = root.querySelector("canvas");
    this.painter = new Painter(this.canvas, parts);
    this.camera = new Camera();
    this.hidden = new Set(parts.filter((part) => part.shown === false));
    this.hovered = this.selected = null;
    this.explode = 0;
    this.section = { axis: -1, at: 0, flip: false };
    this.fitted = true;
    this.asked = false;
    this.control = (name) => root.querySelector(`[data-control="${name}"]`);
    this.listParts();
    this.wireControls();
    wirePointer(this);
    wireKeys(this);
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.painter = new Painter(this.canvas, this.parts);
      this.redraw();
    });
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    this.parts.forEach((part) => this.show(part, !this.hidden.has(part)));
    this.render();
  }

  // Show other parts from the same side; a part that was hidden stays hidden.
  replace(parts) {
    const hidden = new Set([...this.hidden].map((part) => part.name));
    const selected = this.selected?.name;
    this.painter.free();
    this.parts = parts;
    this.hidden = new Set(parts.filter((part) => hidden.has(part.name)));
    this.hovered = null;
    this.selected = parts.find((part) => part.name === selected) || null;
    this.painter = new Painter(this.canvas, parts);
    this.root.querySelector(".parts").replaceChildren();
    this.listParts();
    this.parts.forEach((part) => this.show(part, !this.hidden.has(part)));
    this.setSection(this.section.axis, this.section.at);
    this.redraw();
  }

  shift(part) {
    return part.explode.map((value) => value * this.explode);
  }

  corners(shownOnly = true) {
    const out = [];
    for (const part of this.parts) {
      if (shownOnly && this.hidden.has(part)) continue;
      const { low, high } = part.box, shift = this.shift(part);
      for (let i = 0; i < 8; i++)
        out.push([0, 1, 2].map((k) => ((i >> k) & 1 ? high[k] : low[k]) + shift[k]));
    }
    return out.length ? out : shownOnly ? this.corners(false) : [[0, 0, 0]];
  }

  aspect() {
    return this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
  }

  fit() {
    this.fitted = true;
    this.redraw();
  }

  redraw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.render(); });
  }

  scene() {
    const { axis, at, flip } = this.section, on = axis >= 0, back = this.camera.axes().back;
    const sign = axis === 1 ? -1 : 1, way = flip ? -sign : sign;  // cut away what faces the viewer
    const plane = on ? [0, 1, 2, 3].map((k) => (k === axis ? way : k === 3 ? way * at : 0)) : null;
    const style = getComputedStyle(this.root), ratio = devicePixelRatio || 1;
    const rgb = (name) => style.getPropertyValue(name).trim().split(/\s+/).map((v) => v / 255);
    const accent = rgb("--accent-rgb"), linear = accent.map((v) => v ** 2.2);
    return { camera: this.camera.matrix(this.aspect()), eye: this.camera.eye(), key: this.camera.key(),
      background: rgb("--stage-rgb"), accent, plane, section: this.section, hatch: 9 * ratio,
      visible: (part) => !this.hidden.has(part), shift: (part) => this.shift(part),
      tint: (part) => [...linear, part === this.selected ? 0.6 : part === this.hovered ? 0.4 : 0],
      depth: ({ box, explode }) => dot3(back, [0, 1, 2].map(
        (k) => (box.low[k] + box.high[k]) / 2 + explode[k] * this.explode)) };
  }

  render() {
    const { canvas } = this, ratio = Math.min(devicePixelRatio || 1, 2.5);
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (!w || !h) return;
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    if (this.fitted) this.camera.fit(this.corners(), this.aspect());
    else this.camera.widen(this.corners());
    this.root.dataset.triangles = this.painter.draw(this.scene());
    this.root.dataset.parts = this.parts.length - this.hidden.size;
    this.drawScale();
  }

  drawScale() {
    const perMm = this.canvas.clientHeight / (2 * this.camera.height);
    const length = [500, 200, 100, 50, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1].find((l) => l * perMm < 130) || 0.1;
    const bar = this.root.querySelector(".scale");
    bar.firstElementChild.style.width = `${length * perMm}px`;
    bar.lastElementChild.textContent = `${length} mm`;
    const { right, up } = this.camera.axes();
    this.root.querySelectorAll(".triad g").forEach((group, k) => {
      const [x, y] = [26 * right[k], -26 * up[k]], [line, label] = group.children;
      line.setAttribute("x2", x);
      line.setAttribute("y2", y);
      label.setAttribute("x", x * 1.38);
      label.setAttribute("y", y * 1.38);
    });
  }

  pick(event) {
    const { canvas } = this, frame = canvas.getBoundingClientRect();
    const x = (2 * (event.clientX - frame.left)) / frame.width - 1;
    const y = 1 - (2 * (event.clientY - frame.top)) / frame.height;
    const camera = this.camera.pickMatrix(this.aspect(), x, y, 2 / frame.width, 2 / frame.height);
    return this.painter.pick(this.scene(), camera);
  }

  mark(part, kind) {
    if (this[kind] === part) return;
    this[kind] = part;
    this.rows.forEach((row, other) => {
      row.classList.toggle("hovered", other === this.hovered);
      row.querySelector("button").setAttribute("aria-pressed", other === this.selected);
    });
    const named = this.hovered || this.selected;
    this.root.querySelector(".named").textContent = named ? named.name : "";
    this.redraw();
  }

  show(part, shown) {
    if (shown) this.hidden.delete(part);
    else this.hidden.add(part);
    this.rows.get(part).querySelector("input").checked = shown;
    this.redraw();
  }

  listParts() {
    const list = this.root.querySelector(".parts"), template = this.root.querySelector("template");
    this.rows = new Map();
    for (const part of this.parts) {
      const row = template.content.firstElementChild.cloneNode(true);
      const [box, button] = [row.querySelector("input"), row.querySelector("button")];
      const srgb = part.colour.slice(0, 3).map((v) => Math.round(255 * v ** 0.4545));
      row.querySelector(".swatch").style.background = `rgb(${srgb.join(" ")} / ${part.colour[3]})`;
      button.textContent = part.name;
      box.setAttribute("aria-label", `show ${part.name}`);
      box.addEventListener("change", () => this.show(part, box.checked));
      button.addEventListener("click", () => this.mark(this.selected === part ? null : part, "selected"));
      row.addEventListener("pointerenter", () => this.mark(part, "hovered"));
      row.addEventListener("pointerleave", () => this.mark(null, "hovered"));
      list.append(row);
      this.rows.set(part, row);
    }
  }

  setView(name) {
    if (name === "section") {
      this.camera.look("side");
      this.camera.perspective = this.control("perspective").checked = false;
      this.setSection(1, 0);
    } else this.camera.look(name);
    this.fit();
  }

  setSection(axis, at) {
    const slider = this.control("at"), points = this.corners(false);
    this.section.axis = axis;
    this.control("axis").value = axis;
    slider.disabled = this.control("flip").disabled = axis < 0;
    if (axis >= 0) {
      const values = points.map((p) => p[axis]);
      slider.min = Math.floor(10 * Math.min(...values)) / 10;
      slider.max = Math.ceil(10 * Math.max(...values)) / 10;
      slider.value = this.section.at = at;
    }
    this.showAt();
    this.redraw();
  }

  showAt() {
    const { axis, at } = this.section;
    this.root.querySelector(".at").textContent = axis < 0 ? "off" : `${"xyz"[axis]} = ${at.toFixed(1)} mm`;
  }

  setExplode(amount) {
    this.explode = amount;
    this.control("explode").value = amount;
    this.root.querySelector(".explosion").textContent = `${Math.round(100 * amount)} %`;
    this.redraw();
  }

  wireControls() {
    const on = (name, act) => this.control(name).addEventListener("input", (e) => act(e.target));
    on("explode", (t) => this.setExplode(Number(t.value)));
    on("axis", (t) => this.setSection(Number(t.value), 0));
    on("at", (t) => { this.section.at = Number(t.value); this.showAt(); this.redraw(); });
    on("flip", (t) => { this.section.flip = t.checked; this.redraw(); });
    on("perspective", (t) => { this.camera.perspective = t.checked; this.redraw(); });
    for (const button of this.root.querySelectorAll("[data-view]"))
      button.addEventListener("click", () => this.setView(button.dataset.view));
    this.control("all").addEventListener("click", () => this.parts.forEach((p) => this.show(p, p.shown !== false)));
    this.control("optics").addEventListener("click", () =>
      this.parts.forEach((p) => this.show(p, OPTICS.test(p.name))));
    this.control("only").addEventListener("click", () => {
      if (this.selected) this.parts.forEach((p) => this.show(p, p === this.selected));
    });
    this.setSection(-1, 0);
    this.setExplode(0);
    this.control("flip").checked = false;
    this.control("perspective").checked = true;
  }
}
