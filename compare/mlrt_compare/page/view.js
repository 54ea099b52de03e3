// The part of the report that shows images, and what keys and mouse do.

function makeView(data, images) {
  const { width, height } = images;
  const canvas = document.getElementById("canvas");
  const sheet = document.getElementById("sheet");
  const frame = document.getElementById("frame");
  const handle = document.getElementById("handle");
  const context = canvas.getContext("2d", { willReadFrequently: true });
  canvas.width = width;
  canvas.height = height;

  // A few pixels cost many times as much as all others, which would be black beside them.
  const mostCost = images.cost && Math.max(quantile(images.cost, 0.995), 1e-9);
  const views = [
    ["first", data.names[0], "1"],
    ["second", data.names[1], "2"],
    ["slider", "slider", "S"],
    ["difference", "difference", "D"],
  ];
  if (images.cost) views.push(["cost", "traversal cost", "C"]);

  const state = { view: "first", exposure: 0, split: 0.5, zoom: 1, kind: "signed", scale: 0 };
  let shown = {};

  function pictures() {
    if (shown.exposure !== state.exposure || !shown.first) {
      shown = {
        exposure: state.exposure,
        first: developed(images.first, state.exposure),
        second: developed(images.second, state.exposure),
      };
    }
    return shown;
  }

  function pixels() {
    if (state.view === "difference") {
      return differences(images.first, images.second, state.kind, 10 ** state.scale);
    }
    if (state.view === "cost") return costMap(images.cost, mostCost);
    const { first, second } = pictures();
    if (state.view !== "slider") return state.view === "first" ? first : second;
    const border = Math.round(state.split * width);
    const mixed = second.slice();
    for (let y = 0; y < height; y++) {
      const row = 4 * y * width;
      mixed.set(first.subarray(row, row + 4 * border), row);
    }
    return mixed;
  }

  function draw() {
    context.putImageData(new ImageData(pixels(), width, height), 0, 0);
    handle.hidden = state.view !== "slider";
    handle.style.left = `${100 * state.split}%`;
    for (const [name] of views) {
      document.getElementById(`view-${name}`)
        .setAttribute("aria-pressed", String(name === state.view));
    }
    document.getElementById("exposure").value = state.exposure;
    document.getElementById("exposure-value").textContent =
      `${state.exposure >= 0 ? "+" : ""}${state.exposure} EV`;
    document.getElementById("error-value").textContent = (10 ** state.scale).toPrecision(2);
    document.getElementById("error-scale").value = state.scale;
    document.getElementById("legend").textContent = legend();
    document.body.dataset.view = state.view;
  }

  function legend() {
    const white = (10 ** state.scale).toPrecision(2);
    if (state.view === "cost") {
      return "Nodes visited and triangles tested for a sample, those of a beam shared among " +
        `its rays: black for none, bright yellow from ${mostCost.toPrecision(3)} on, which ` +
        "0.5 % of the pixels exceed.";
    }
    if (state.view !== "difference") {
      return "Linear values, exposed and in the curve of sRGB; what is not finite is magenta.";
    }
    return state.kind === "signed"
      ? `Orange where ${data.names[0]} is brighter, blue where ${data.names[1]} is; full ` +
        `brightness at ${white}.`
      : `The largest ${state.kind} difference of a channel, logarithmic: bright yellow from ` +
        `${white} on, black at a ten-thousandth of it.`;
  }

  function show(view) {
    if (views.some(([name]) => name === view)) {
      state.view = view;
      draw();
    }
  }

  function expose(stops) {
    state.exposure = Math.min(Math.max(stops, -12), 12);
    draw();
  }

  function resize(zoom) {
    state.zoom = Math.min(Math.max(zoom, 1 / 16), 64);
    sheet.style.width = `${width * state.zoom}px`;
    sheet.style.height = `${height * state.zoom}px`;
    document.getElementById("zoom-value").textContent = `${+(100 * state.zoom).toPrecision(3)} %`;
    document.body.dataset.zoom = String(state.zoom);
  }

  function fit() {
    const room = (window.innerHeight * 0.8 - 2) / height;
    resize(Math.min((frame.clientWidth - 2) / width, Math.max(room, 0.25)));
  }

  // Zooms so that the point under (x, y) of the frame stays where it is.
  function zoomAt(factor, x, y) {
    const before = state.zoom;
    const left = frame.scrollLeft + x, top = frame.scrollTop + y;
    resize(before * factor);
    frame.scrollLeft = left * state.zoom / before - x;
    frame.scrollTop = top * state.zoom / before - y;
  }

  function zoomMiddle(factor) {
    zoomAt(factor, frame.clientWidth / 2, frame.clientHeight / 2);
  }

  function place(event) {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  }

  function tell(event) {
    const [u, v] = place(event);
    const x = Math.floor(u * width), y = Math.floor(v * height);
    if (x < 0 || y < 0 || x >= width || y >= height) return;
    const at = 3 * (y * width + x);
    const text = (image) => [0, 1, 2].map((c) => image[at + c].toPrecision(7)).join("  ");
    const delta = [0, 1, 2].map((c) =>
      (images.first[at + c] - images.second[at + c]).toExponential(2)).join("  ");
    const cost = images.cost ? `   cost ${images.cost[y * width + x].toPrecision(4)}` : "";
    document.getElementById("pixel").textContent =
      `column ${x}, row ${y}${cost}   difference ${delta}\n` +
      `${data.names[0]}: ${text(images.first)}\n${data.names[1]}: ${text(images.second)}`;
  }

  for (const [name, label, key] of views) {
    const button = document.createElement("button");
    button.id = `view-${name}`;
    button.textContent = label;
    button.title = `key ${key}`;
    button.onclick = () => show(name);
    document.getElementById("views").append(button);
  }
  document.getElementById("exposure").oninput = (event) => expose(+event.target.value);
  document.getElementById("error-kind").onchange = (event) => {
    state.kind = event.target.value;
    show("difference");
  };
  document.getElementById("error-scale").oninput = (event) => {
    state.scale = +event.target.value;
    show("difference");
  };
  document.getElementById("zoom-in").onclick = () => zoomMiddle(2);
  document.getElementById("zoom-out").onclick = () => zoomMiddle(0.5);
  document.getElementById("zoom-fit").onclick = fit;

  const keys = {
    f: () => show(state.view === "first" ? "second" : "first"),
    1: () => show("first"),
    2: () => show("second"),
    s: () => show("slider"),
    d: () => show("difference"),
    c: () => show("cost"),
    "[": () => expose(state.exposure - 0.5),
    "]": () => expose(state.exposure + 0.5),
    "+": () => zoomMiddle(2),
    "=": () => zoomMiddle(2),
    "-": () => zoomMiddle(0.5),
    0: fit,
  };
  document.addEventListener("keydown", (event) => {
    const action = keys[event.key.toLowerCase()];
    const typing = event.target instanceof HTMLSelectElement;
    if (action && !typing && !event.ctrlKey && !event.metaKey && !event.altKey) {
      event.preventDefault();
      action();
    }
  });
  frame.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    const box = frame.getBoundingClientRect();
    zoomAt(event.deltaY < 0 ? 1.25 : 0.8, event.clientX - box.left, event.clientY - box.top);
  }, { passive: false });
  let dragging = false;
  sheet.addEventListener("pointerdown", (event) => {
    if (state.view !== "slider") return;
    dragging = true;
    sheet.setPointerCapture(event.pointerId);
    move(event);
  });
  function move(event) {
    tell(event);
    if (!dragging) return;
    state.split = Math.min(Math.max(place(event)[0], 0), 1);
    draw();
  }
  sheet.addEventListener("pointermove", move);
  for (const end of ["pointerup", "pointercancel"]) {
    sheet.addEventListener(end, () => { dragging = false; });
  }
  // Middle grey for the mean of the reference; full brightness for the largest difference.
  state.exposure = data.exposure;
  state.scale = data.error_scale;
  document.getElementById("left-name").textContent = data.names[0];
  document.getElementById("right-name").textContent = data.names[1];
  fit();
  draw();
}
