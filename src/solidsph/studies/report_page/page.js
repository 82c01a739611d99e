// Behaviour of a report in the browser: plots, a table to sort and filter, and scenes.
"use strict";

(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const plots = [document.getElementById("by-cost"), document.getElementById("by-spacing")];
  const choices = [...document.querySelectorAll("[data-expense]")];
  const body = document.querySelector("#points tbody");
  const rows = [...body.rows];
  const config = {
    responsive: true,
    displaylogo: false,
    plotlyServerURL: "", // data are sent nowhere
    modeBarButtonsToRemove: ["select2d", "lasso2d", "sendChartToCloud", "sendDataToCloud"],
  };
  let expense = data.expenses.findIndex((one) => one !== null);
  let chosen = null;

  // --- plots -----------------------------------------------------------------------------------

  // Legends have a smaller font in a narrow window, which leaves more room for the plot.
  const legendSize = () => (window.innerWidth < 700 ? 10 : 12);

  async function draw() {
    const { figures } = data.expenses[expense];
    for (const [place, plot] of plots.entries()) {
      const figure = structuredClone(figures[place]);
      figure.layout.legend.font = { size: legendSize() };
      await Plotly.react(plot, figure.data, figure.layout, config);
    }
    await ring();
  }

  // Ring around the chosen point in both plots: the last trace, which is empty otherwise.
  async function ring() {
    const places = chosen === null ? null : data.points[chosen].places;
    for (const [index, plot] of plots.entries()) {
      const across = places && (index === 0 ? places.costs[expense] : places.spacing);
      const where = across === null ? { x: [[]], y: [[]] } : { x: [[across]], y: [[places.error]] };
      await Plotly.restyle(plot, where, [plot.data.length - 1]);
    }
  }

  function choose(number) {
    expense = number;
    for (const button of choices) {
      button.setAttribute("aria-pressed", String(Number(button.dataset.expense) === number));
    }
    const front = new Set(data.expenses[number].front);
    for (const row of rows) {
      const there = front.has(Number(row.dataset.point));
      row.classList.toggle("front", there);
      row.cells[1].textContent = there ? "front" : "";
    }
    filter(); // what is on the front may have changed
    return draw();
  }

  // --- scenes ----------------------------------------------------------------------------------

  function made(tag, properties, ...inside) {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...inside);
    return element;
  }

  async function copy(text, button) {
    const before = button.textContent;
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
    } catch {
      button.textContent = "Not allowed here: download it";
    }
    setTimeout(() => (button.textContent = before), 2000);
  }

  function block(scene) {
    const heading = made("h3", {}, scene.name);
    if (scene.toml === undefined) return [heading, made("p", {}, scene.why)];
    const copier = made("button", { type: "button" }, "Copy");
    copier.addEventListener("click", () => copy(scene.toml, copier));
    const file = URL.createObjectURL(new Blob([scene.toml], { type: "application/toml" }));
    const link = made("a", { className: "button", href: file, download: scene.file });
    link.append(`Download ${scene.file}`);
    return [
      heading,
      made("div", { className: "bar" }, copier, link),
      made("pre", { tabIndex: 0 }, scene.toml),
    ];
  }

  function show(number) {
    chosen = number;
    const point = data.points[number];
    for (const row of rows) {
      if (Number(row.dataset.point) === number) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
    }
    const old = document.querySelectorAll("#scenes a.button");
    for (const link of old) URL.revokeObjectURL(link.href);
    document.getElementById("scene-heading").textContent = `Scene of configuration ${number + 1}`;
    document.getElementById("chosen").textContent = `${point.label}: ${point.brief}`;
    const inside = point.scenes.length ? point.scenes.flatMap(block) : [made("p", {}, point.note)];
    document.getElementById("scenes").replaceChildren(...inside);
    document.getElementById("back").hidden = false;
    const panel = document.getElementById("scene");
    panel.scrollTop = 0;
    const { top } = panel.getBoundingClientRect();
    if (top < 0 || top > 0.8 * window.innerHeight) panel.scrollIntoView();
    ring();
  }

  // --- table -----------------------------------------------------------------------------------

  // Numbers before words, and empty cells last, in either direction.
  function compare(a, b, sign) {
    const [x, y] = [a, b].map((cell) => cell.dataset.number);
    const [s, t] = [a, b].map((cell) => cell.textContent);
    if (!s || !t) return Number(!s) - Number(!t);
    if (x !== undefined && y !== undefined) return sign * (Number(x) - Number(y));
    if (x !== undefined || y !== undefined) return x === undefined ? 1 : -1;
    return sign * s.localeCompare(t);
  }

  function sort(heading) {
    const down = heading.getAttribute("aria-sort") === "ascending";
    for (const other of heading.parentElement.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
    const place = heading.cellIndex;
    rows.sort((a, b) => compare(a.cells[place], b.cells[place], down ? -1 : 1));
    body.append(...rows);
  }

  // Show the rows that contain every word, in any column.
  function filter() {
    const words = document.getElementById("filter").value.toLowerCase().split(/\s+/);
    let there = 0;
    for (const row of rows) {
      const text = [...row.cells].map((cell) => cell.textContent.toLowerCase()).join(" ");
      row.hidden = !words.every((word) => text.includes(word));
      there += Number(!row.hidden);
    }
    document.getElementById("count").textContent = `${there} of ${rows.length}`;
  }

  // --- events ----------------------------------------------------------------------------------

  for (const heading of document.querySelectorAll("#points thead th")) {
    heading.querySelector("button").addEventListener("click", () => sort(heading));
  }
  document.getElementById("filter").addEventListener("input", filter);
  body.addEventListener("click", (event) => {
    const row = event.target.closest("tr");
    const selecting = !event.target.closest("button") && String(window.getSelection());
    if (row && !selecting) show(Number(row.dataset.point));
  });
  for (const button of choices) {
    button.addEventListener("click", () => choose(Number(button.dataset.expense)));
  }
  filter();
  if (expense < 0) return; // no cost is known for all points, so there is nothing to draw
  choose(expense).then(() => {
    for (const plot of plots) {
      plot.on("plotly_click", (event) => {
        const number = event.points[0].customdata;
        if (number !== undefined) show(number);
      });
    }
    document.documentElement.dataset.ready = "true";
  });
})();
