// Mouse, touch and keys for the viewer, and its start.

function wirePointer(viewer) {
  const { canvas, camera } = viewer, touches = new Map();
  let moved = 0;
  const span = () => {
    const [a, b] = [...touches.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.hypot(a.x - b.x, a.y - b.y) || 1 };
  };
  const perPixel = () => (2 * camera.height) / canvas.clientHeight;
  canvas.addEventListener("pointerdown", (event) => {
    touches.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = touches.get(event.pointerId);
    if (!last) {
      if (event.pointerType === "mouse") viewer.mark(viewer.pick(event), "hovered");
      return;
    }
    const before = touches.size === 2 ? span() : null;
    const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
    touches.set(event.pointerId, { x: event.clientX, y: event.clientY });
    moved += Math.abs(dx) + Math.abs(dy);
    if (before) {
      const now = span();
      camera.pan((now.x - before.x) * perPixel(), (now.y - before.y) * perPixel());
      camera.zoom(before.size / now.size, camera.reach);
      viewer.fitted = false;
    } else if (event.shiftKey || event.buttons & 6) {
      camera.pan(dx * perPixel(), dy * perPixel());
      viewer.fitted = false;
    } else camera.orbit(dx * 0.4, dy * 0.4);
    viewer.redraw();
  });
  const lift = (event) => {
    if (event.type === "pointerup" && touches.has(event.pointerId) && moved < 5) {
      const part = viewer.pick(event);
      viewer.mark(part === viewer.selected ? null : part, "selected");
    }
    touches.delete(event.pointerId);
  };
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, lift);
  canvas.addEventListener("pointerleave", () => viewer.mark(null, "hovered"));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => viewer.fit());
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;  // let the page scroll
    event.preventDefault();
    camera.zoom(Math.exp(Math.sign(event.deltaY) * Math.min(0.25, Math.abs(event.deltaY) * 0.0015)), camera.reach);
    viewer.fitted = false;
    viewer.redraw();
  }, { passive: false });
}

function wireKeys(viewer) {
  const { canvas, camera } = viewer, views = ["iso", "top", "side", "tip", "section"];
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = arrows[event.key], number = "12345".indexOf(event.key);
    if (arrow && event.shiftKey) {
      camera.pan(arrow[0] * camera.height * 0.08, arrow[1] * camera.height * 0.08);
      viewer.fitted = false;
    } else if (arrow) camera.orbit(arrow[0] * 7.5, arrow[1] * 7.5);
    else if (event.key === "+" || event.key === "=" || event.key === "-") {
      camera.zoom(event.key === "-" ? 1.15 : 1 / 1.15, camera.reach);
      viewer.fitted = false;
    } else if (number >= 0) viewer.setView(views[number]);
    else if (event.key === "e") viewer.setExplode(viewer.explode > 0.5 ? 0 : 1);
    else if (event.key === "f") viewer.fit();
    else if (event.key === "Escape") viewer.mark(null, "selected");
    else return;
    event.preventDefault();
    viewer.redraw();
  });
}

// Dots, camera's view and paths of light, which are no parts: open surfaces without normals.
function readOverlays() {
  const data = document.getElementById("overlays");
  return JSON.parse(data ? data.textContent : "[]").map((overlay) => {
    const positions = Float32Array.from(overlay.positions);
    return { ...overlay, positions, indices: Uint32Array.from(overlay.indices), normals: null,
      open: true, box: boxOf(positions) };
  });
}

function startViewer() {
  const root = document.getElementById("viewer"), model = document.getElementById("model");
  if (!root || !model) return;
  try {
    const parts = [...parseGlb(decodeBase64(model.textContent)), ...readOverlays()];
    root.dataset.state = "ready";  // shown before it is measured
    window.fingerViewer = new Viewer(root, parts);
  } catch (error) {
    root.dataset.state = "failed";
    root.querySelector(".why").textContent = `${error.message}.`;
  }
}
