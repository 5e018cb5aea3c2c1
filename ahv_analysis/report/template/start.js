"use strict";
// Brings a page to life once all of its scripts are there.

for (const swatch of document.querySelectorAll(".swatch")) {
  swatch.style.color = colour(Number(swatch.dataset.flight));
}
for (const figure of document.querySelectorAll(".plot")) build(figure);
for (const button of document.querySelectorAll("button[data-until]")) {
  button.addEventListener("click", () =>
    show(whole.min, button.dataset.until ? whole.min + Number(button.dataset.until) : whole.max));
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const chart of charts) chart.redraw(false);
});

openScene();
seek(whole.min);
