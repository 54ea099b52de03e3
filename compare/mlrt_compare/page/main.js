// Timings, tables and the plot; then the images.

function element(parent, tag, name, text) {
  const child = document.createElement(tag);
  if (name) child.className = name;
  if (text !== undefined) child.textContent = text;
  parent.append(child);
  return child;
}

function seconds(value) {
  if (value === null) return "not told";
  return value < 1 ? `${(1000 * value).toPrecision(3)} ms` : `${value.toPrecision(3)} s`;
}

function timingBars(data) {
  const root = document.getElementById("timings");
  const legend = element(root, "p", "legend note");
  data.timings.forEach((side, number) => {
    element(legend, "span", number ? "second" : "first");
    legend.append(side.name);
  });
  const rows = [
    ["load", "load"], ["build of the tree", "build"], ["JIT compiler", "jit"],
    ["first frame", "first"], ["frame", "steady"],
  ];
  for (const [label, key] of rows) {
    const values = data.timings.map((side) => side[key]);
    if (values.every((value) => value === null)) continue;
    // Each row has a scale of its own: a frame would not be seen beside what is done once.
    const most = Math.max(...values.map((value) => value ?? 0), 1e-9);
    const row = element(root, "div", "row");
    element(row, "div", "name", label);
    const bars = element(row, "div");
    values.forEach((value, number) => {
      const stack = element(bars, "div", "stack");
      const fill = element(stack, "div", `fill ${number ? "second" : "first"}`);
      fill.style.width = `${80 * Math.max(value ?? 0, 0) / most}%`;
      element(stack, "span", "value", key === "jit" && value === null ? "none" : seconds(value));
    });
  }
  document.getElementById("timing-notes").textContent = data.timing_notes.join(" ");
}

function table(id, rows) {
  const root = document.getElementById(id);
  for (const [name, value] of rows) {
    const row = element(root, "tr");
    element(row, "td", "", name);
    element(row, "td", "", value);
  }
}

async function main() {
  const data = JSON.parse(document.getElementById("data").textContent);
  document.getElementById("title").textContent = data.title;
  const verdict = document.getElementById("verdict");
  verdict.textContent = data.verdict;
  verdict.className = data.passed ? "passed" : "failed";
  timingBars(data);
  for (const id of ["difference", "settings", "machine"]) table(id, data[id]);
  if (data.plot !== null) {
    document.getElementById("plot").hidden = false;
    document.getElementById("plot-image").src = `data:image/svg+xml;base64,${data.plot}`;
    document.getElementById("plot-notes").textContent = data.plot_notes;
  }
  if (typeof DecompressionStream === "undefined") {
    throw new Error("this browser cannot unpack the images: it lacks DecompressionStream");
  }
  makeView(data, await decodeImages(data));
  document.body.dataset.ready = "true";
}

main().catch((error) => {
  document.getElementById("pixel").textContent = `The images cannot be shown: ${error.message}`;
  document.body.dataset.ready = "failed";
});
