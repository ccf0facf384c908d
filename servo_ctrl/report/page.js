"use strict";
const figures = JSON.parse(document.getElementById("figures").textContent);
const waiting = [...document.querySelectorAll(".plot")];
// one by one, so that the page can be read while the rest is drawn
function next() {
  const plot = waiting.shift();
  if (!plot) { document.body.dataset.ready = "yes"; return; }
  const { data, layout } = figures[plot.id];
  Plotly.newPlot(plot, data, layout, { responsive: true, displaylogo: false });
  setTimeout(next, 0);
}
next();
