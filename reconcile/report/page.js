"use strict";
const figures = JSON.parse(document.getElementById("figures").textContent);
// a finger cannot hover: without the bar it pans and pinches all the same
const hovers = matchMedia("(hover: hover)").matches ? "hover" : false;
const colours = /color$|bgcolor$/;

function resolved(node, style, key) {
  if (typeof node === "string") {
    return key && colours.test(key) && node.startsWith("--") ? style.getPropertyValue(node).trim() : node;
  }
  if (Array.isArray(node)) return node.map((item) => resolved(item, style, key));
  if (node && typeof node === "object") {
    return Object.fromEntries(Object.entries(node).map(([name, value]) => [name, resolved(value, style, name)]));
  }
  return node;
}

function draw(plot) {
  const figure = figures[plot.dataset.figure];
  const style = getComputedStyle(document.documentElement);
  const config = { responsive: true, displaylogo: false, displayModeBar: hovers, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
  Plotly.react(plot, resolved(figure.data, style), resolved(figure.layout, style), config);
  plot.dataset.drawn = "yes";
}

// the visible ones first, then one by one: the page answers while the others are drawn
const plots = [...document.querySelectorAll(".plot")];
const shown = (plot) => plot.offsetParent !== null;
const waiting = [...plots.filter(shown), ...plots.filter((plot) => !shown(plot))];
function next() {
  const plot = waiting.shift();
  if (!plot) { document.body.dataset.ready = "yes"; return; }
  draw(plot);
  setTimeout(next, 0);
}
next();

for (const choice of document.querySelectorAll("select[data-group]")) {
  choice.addEventListener("change", () => {
    for (const card of document.querySelectorAll("[data-member]")) {
      if (card.dataset.member !== choice.dataset.group) continue;
      card.hidden = card.dataset.number !== choice.value;
      if (!card.hidden) card.querySelectorAll(".plot").forEach((plot) => { draw(plot); Plotly.Plots.resize(plot); });
    }
  });
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plots.forEach(draw));
