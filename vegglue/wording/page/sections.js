// Shows the values of the station under the pointer or the keyboard, one experiment, and the model before or after.
// It draws nothing: without it every section of every experiment stands in the page.
(() => {
  "use strict";
  const LINES = { measured: "measured", before: "before", after: "with it" };

  const written = (value) => (value === null ? "unknown" : value.toFixed(3).replace("-", "−"));

  const toldAt = (panel, k) => {
    const error = panel.error[k] === null ? "" : ` ± ${written(panel.error[k])}`;
    const why = panel.reason[k] ? `, ${panel.reason[k]}` : "";
    const first = `${written(panel.measured[k])}${error}${panel.aside[k] ? ` (excluded${why})` : ""}`;
    const model = panel.before ? "with it" : "model";
    const before = panel.before ? `, before ${written(panel.before[k])}` : "";
    const y = String(panel.y[k]).replace("-", "−");
    return `y = ${y} m: measured ${first}${before}, ${model} ${written(panel.after[k])} ${panel.unit}`;
  };

  const moveCursor = (svg, panel, k) => {
    const cursor = svg.querySelector(".cursor");
    cursor.setAttribute("visibility", "visible");
    cursor.setAttribute("transform", `translate(${panel.across[k]},0)`);
    for (const line of Object.keys(LINES)) {
      const ring = cursor.querySelector(`.${line}`);
      const height = panel.down[line] ? panel.down[line][k] : null;
      ring.setAttribute("visibility", height === null ? "hidden" : "inherit");
      ring.setAttribute("cy", height === null ? 0 : height);
    }
  };

  const nearest = (panel, across) => {
    const away = panel.across.map((place) => Math.abs(place - across));
    return away.indexOf(Math.min(...away));
  };

  const listen = (figure, panel) => {
    const box = figure.querySelector(".drawing"), svg = box.querySelector("svg");
    const readout = figure.querySelector("output"), rest = readout.textContent;
    let at = 0;
    const show = (k) => {
      at = Math.max(0, Math.min(panel.y.length - 1, k));
      moveCursor(svg, panel, at);
      readout.textContent = toldAt(panel, at);
    };
    const leave = () => {
      svg.querySelector(".cursor").setAttribute("visibility", "hidden");
      readout.textContent = rest;
    };
    const point = (event) => {
      const seen = svg.getBoundingClientRect();
      show(nearest(panel, ((event.clientX - seen.left) / seen.width) * svg.viewBox.baseVal.width));
    };
    const steps = { ArrowLeft: () => at - 1, ArrowRight: () => at + 1, Home: () => 0, End: () => panel.y.length - 1 };
    box.addEventListener("pointermove", point);
    box.addEventListener("pointerdown", point);
    box.addEventListener("pointerleave", leave);
    box.addEventListener("focus", () => show(at));
    box.addEventListener("blur", leave);
    box.addEventListener("keydown", (event) => {
      if (event.key in steps) {
        event.preventDefault();
        show(steps[event.key]());
      }
    });
  };

  const chooseExperiment = (sections, place) => {
    sections.querySelectorAll(".experiment").forEach((one, k) => one.classList.toggle("off", k !== place));
  };

  for (const sections of document.querySelectorAll(".sections")) {
    const panels = JSON.parse(sections.querySelector("script").textContent);
    for (const panel of panels) {
      const figures = [...sections.querySelectorAll("figure")];
      listen(figures.find((figure) => figure.dataset.panel === panel.id), panel);
    }
    sections.querySelector(".controls").hidden = false;
    for (const input of sections.querySelectorAll("input")) {
      input.addEventListener("change", () => {
        if (input.name.endsWith("view")) sections.dataset.view = input.value;
        else chooseExperiment(sections, Number(input.value));
      });
    }
    if (sections.querySelectorAll(".experiment").length > 1) chooseExperiment(sections, 0);
  }

  // On paper nothing can be unfolded.
  const folded = () => document.querySelectorAll("details:not([open])");
  let unfolded = [];
  addEventListener("beforeprint", () => {
    unfolded = [...folded()];
    for (const one of unfolded) one.open = true;
  });
  addEventListener("afterprint", () => {
    for (const one of unfolded) one.open = false;
  });
})();
