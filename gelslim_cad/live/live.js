// Shows each state that the server sends: problems, figures, prices, and the solids when ready.

const element = (id) => document.getElementById(id);
const root = element("viewer");
root.querySelector(".fallback strong").textContent = "No 3D view yet.";
root.querySelector(".why").textContent = "The solids are being made.";
let viewer = null, shownDesign = 0, shownModel = 0, before = new Map(), tiles = new Map();

function make(tag, content, kind) {
  const made = document.createElement(tag);
  if (kind) made.className = kind;
  made.textContent = content;
  return made;
}

function number(value) {
  return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(5)));
}

function showProblems(lines) {
  const box = element("problems");
  box.hidden = !lines.length;
  box.replaceChildren(...lines.map((line) => make("p", line)));
  if (lines.length) box.append(make("p", "Below is the last design that could be read.", "soft"));
  for (const part of document.querySelectorAll("main, .tiles")) part.classList.toggle("stale", lines.length > 0);
}

function showFigures(state) {
  element("name").textContent = document.title = state.name;
  const verdict = make("span", state.verdict.phrase, `pill ${state.verdict.status}`);
  element("verdict").replaceChildren(verdict);
  element("headline").replaceChildren(...state.headline.map(([label, value]) => {
    const tile = document.createElement("div"), shown = make("dd", value), was = tiles.get(label);
    if (was !== undefined && was !== value) shown.append(make("span", `was ${was}`, "was"));
    tile.append(make("dt", label), shown);
    return tile;
  }));
  tiles = new Map(state.headline);
  const only = document.querySelector("#rules input[value=open]")?.checked ?? true;
  element("rules").innerHTML = state.rules;  // written and escaped by the program
  wireRules(only);
  showDimensions(state.dimensions);
}

function wireRules(only) {
  const filter = (open) => document.querySelectorAll("#rules .rule").forEach((rule) => {
    rule.hidden = open && rule.dataset.status === "pass";
  });
  for (const input of document.querySelectorAll("#rules input[name=rule-status]")) {
    input.addEventListener("change", () => filter(input.value === "open"));
    input.checked = (input.value === "open") === only;
  }
  filter(only);
}

function showDimensions(dimensions) {
  const differs = ([name, value]) => before.has(name) && number(before.get(name)) !== number(value);
  const ordered = [...dimensions.filter(differs), ...dimensions.filter((d) => !differs(d))];
  element("dimensions").replaceChildren(...ordered.map((entry) => {
    const [name, value, unit, meaning] = entry, row = document.createElement("tr");
    const cell = (content, kind) => row.append(make("td", content, kind));
    row.append(document.createElement("td"));
    row.firstChild.append(make("code", name));
    cell(`${number(value)} ${unit}`, "num");
    cell(differs(entry) ? number(before.get(name)) : "", "num");
    cell(meaning);
    row.classList.toggle("changed", differs(entry));
    return row;
  }));
  before = new Map(dimensions.map(([name, value]) => [name, value]));
}

function showPrices(sentences) {
  const lines = sentences || ["Working …"];
  element("prices").replaceChildren(...lines.map((line) => make("li", line)));
}

async function showModel(model) {
  try {
    const answer = await fetch(`model.glb?${model}`);
    const parts = parseGlb(await answer.arrayBuffer());
    if (model !== shownModel) return;  // a newer one came meanwhile
    if (viewer) viewer.replace(parts);
    else {
      root.dataset.state = "ready";
      viewer = window.fingerViewer = new Viewer(root, parts);
    }
    root.dataset.model = model;
  } catch (error) {
    root.querySelector(".why").textContent = `It cannot be drawn: ${error.message}.`;
    if (!viewer) root.dataset.state = "failed";
  }
}

function show(state) {
  showProblems(state.problems || []);
  if (!state.design) return;
  if (state.design !== shownDesign) showFigures(state);
  shownDesign = state.design;
  document.body.dataset.design = state.design;
  showPrices(state.prices);
  const late = state.model && state.model !== state.design;
  element("solids").textContent = state.solids === "ready" ? "" : state.solids === "working"
    ? (late ? "Making the solids; the view is of the design before …" : "Making the solids …") : state.solids;
  if (state.model && state.model !== shownModel) {
    shownModel = state.model;
    showModel(state.model);
  }
}

const events = new EventSource("events");
events.onmessage = (event) => {
  element("connection").textContent = "This page follows the file: save it to see the change.";
  show(JSON.parse(event.data));
};
events.onerror = () => { element("connection").textContent = "gelslim view has ended. Start it again to go on."; };
