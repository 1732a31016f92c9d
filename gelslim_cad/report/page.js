// Search in the dimensions, filter of the rules, and jumps to a dimension.

function wireDimensions() {
  const search = document.getElementById("dimension-search"), said = document.getElementById("dimension-count");
  if (!search) return;
  const groups = [...document.querySelectorAll("#dimensions .group")];
  const choose = document.getElementById("dimension-group");
  const rows = [...document.querySelectorAll("#dimensions .dimension")];
  const words = new Map(rows.map((row) => [row, row.textContent.toLowerCase()]));
  const filter = () => {
    const wanted = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const group of groups) {
      const here = !choose.value || choose.value === group.dataset.group;
      let any = 0;
      for (const row of group.querySelectorAll(".dimension")) {
        row.hidden = !(here && wanted.every((word) => words.get(row).includes(word)));
        if (!row.hidden) any++;
      }
      group.hidden = !any;
      shown += any;
    }
    said.textContent = shown === rows.length ? `${shown} dimensions` : `${shown} of ${rows.length} dimensions`;
  };
  search.addEventListener("input", filter);
  choose.addEventListener("input", filter);
  document.getElementById("dimension-unfold").addEventListener("click", () => {
    const open = rows.some((row) => !row.hidden && !row.open);
    rows.forEach((row) => { if (!row.hidden) row.open = open; });
  });
  const reveal = () => {
    const row = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!row || !row.classList.contains("dimension")) return;
    search.value = choose.value = "";
    filter();
    row.open = true;
    row.scrollIntoView({ block: "center" });
    row.querySelector("summary").focus({ preventScroll: true });
  };
  addEventListener("hashchange", reveal);
  filter();
  reveal();
}

function wireRules() {
  const choice = document.querySelectorAll("#rules input[name=rule-status]");
  choice.forEach((input) => input.addEventListener("change", () => {
    for (const rule of document.querySelectorAll("#rules .rule"))
      rule.hidden = input.value !== "all" && rule.dataset.status === "pass";
  }));
}

wireDimensions();
wireRules();
startViewer();
