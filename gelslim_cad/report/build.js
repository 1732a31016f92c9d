"use strict";
// Ticks and notes are kept in this browser, under the name and the hash of the finger.
(() => {
  const mark = document.body.dataset.mark;
  const inputs = [...document.querySelectorAll("[data-key]")];
  const done = document.getElementById("done"), told = document.getElementById("told");

  function read() {
    try { return JSON.parse(localStorage.getItem(mark) || "{}"); } catch { return {}; }
  }
  function write() {
    const kept = {};
    for (const input of inputs) {
      const value = input.type === "checkbox" ? input.checked : input.value;
      if (value) kept[input.dataset.key] = value;
    }
    try { localStorage.setItem(mark, JSON.stringify(kept)); } catch { /* the page works without it */ }
  }
  function show() {
    const steps = [...document.querySelectorAll(".step")];
    const open = steps.filter((step) => !step.querySelector("h3 input").checked);
    const left = open.reduce((sum, step) => sum + Number(step.dataset.minutes), 0);
    done.max = Math.max(steps.length, 1);
    done.value = steps.length - open.length;
    told.textContent = `${steps.length - open.length} of ${steps.length} steps of the assembly done, about ${left} minutes left`;
  }
  const kept = read();
  for (const input of inputs) {
    const value = kept[input.dataset.key];
    if (input.type === "checkbox") input.checked = Boolean(value);
    else input.value = typeof value === "string" ? value : "";
    input.addEventListener("input", () => { write(); show(); });
  }
  document.getElementById("clear").addEventListener("click", () => {
    for (const input of inputs) if (input.type === "checkbox") input.checked = false;
    write();
    show();
  });
  show();
})();
