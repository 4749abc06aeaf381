// Turns the path, and moves one instant through it and all charts. Without it the page stands as it is.
"use strict";

const page = document.body;
const begin = Number(page.dataset.begin);
const end = Number(page.dataset.end);

// The path: the same projection as lcd_flight/review/view.py.

const space = document.querySelector(".space");
const middle = space.viewBox.baseVal;
const center = space.dataset.center.split(",").map(Number);
const home = {
  azimuth: Number(space.dataset.azimuth),
  elevation: Number(space.dataset.elevation),
  scale: Number(space.dataset.scale),
};
const view = { ...home };
const shapes = [...space.querySelectorAll("[data-xyz]")].map((element) => ({
  element,
  points: element.dataset.xyz.split(" ").map((point) => point.split(",").map(Number)),
}));
const flown = shapes.find((shape) => shape.element.matches("polyline.flown"));
const now = shapes.find((shape) => shape.element.matches(".now"));
const times = flown ? flown.element.dataset.t.split(" ").map(Number) : [];

function project(point) {
  const [x, y, z] = point.map((value, axis) => value - center[axis]);
  const right = x * Math.cos(view.azimuth) - y * Math.sin(view.azimuth);
  const away = x * Math.sin(view.azimuth) + y * Math.cos(view.azimuth);
  const up = z * Math.cos(view.elevation) + away * Math.sin(view.elevation);
  const places = [middle.width / 2 + view.scale * right, middle.height / 2 - view.scale * up];
  return places.map((place) => place.toFixed(1)).join(",");
}

function draw(shape) {
  const places = shape.points.map(project);
  if (shape.element.tagName === "polyline") shape.element.setAttribute("points", places.join(" "));
  else shape.element.setAttribute("transform", `translate(${places[0]})`);
}

let waiting = false;

function redraw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    shapes.forEach(draw);
  });
}

space.addEventListener("pointerdown", (event) => space.setPointerCapture(event.pointerId));
space.addEventListener("pointermove", (event) => {
  if (!space.hasPointerCapture(event.pointerId)) return;
  view.azimuth -= event.movementX * 0.008;
  view.elevation = Math.min(Math.max(view.elevation + event.movementY * 0.008, 0), Math.PI / 2);
  redraw();
});
space.addEventListener("dblclick", () => {
  Object.assign(view, home);
  redraw();
});
space.addEventListener(
  "wheel",
  (event) => {
    if (!event.ctrlKey) return; // plain turning of the wheel scrolls the page
    event.preventDefault();
    view.scale = Math.min(Math.max(view.scale * Math.exp(-event.deltaY * 0.004), home.scale / 4), home.scale * 20);
    redraw();
  },
  { passive: false },
);

// The charts: values are read back from the traces' points.

function readable(svg) {
  const low = Number(svg.dataset.low);
  const high = Number(svg.dataset.high);
  const box = svg.viewBox.baseVal;
  return (y) => {
    const share = 1 - y / box.height;
    return "log" in svg.dataset ? low * (high / low) ** share : low + (high - low) * share;
  };
}

const charts = [...document.querySelectorAll(".plot svg[data-low]")].map((svg) => ({
  plot: svg.parentElement,
  cursor: svg.parentElement.querySelector(".cursor"),
  outputs: [...svg.closest(".chart").querySelectorAll("output")],
  traces: [...svg.querySelectorAll(".trace")].map((trace) => ({ trace, points: null })),
  width: svg.viewBox.baseVal.width,
  value: readable(svg),
}));

function nearest(values, wanted) {
  let first = 0;
  let last = values.length - 1;
  while (last - first > 1) {
    const half = (first + last) >> 1;
    if (values[half] <= wanted) first = half;
    else last = half;
  }
  return Math.abs(values[last] - wanted) < Math.abs(values[first] - wanted) ? last : first;
}

function pointsOf(entry) {
  if (entry.points) return entry.points;
  const numbers = [...entry.trace.children].flatMap((line) => line.getAttribute("points").split(/[ ,]/).map(Number));
  entry.points = { x: numbers.filter((_, n) => n % 2 === 0), y: numbers.filter((_, n) => n % 2 === 1) };
  return entry.points;
}

function valueAt(chart, entry, share) {
  const { x, y } = pointsOf(entry);
  if (!x.length) return "–";
  const place = nearest(x, share * chart.width);
  if (Math.abs(x[place] - share * chart.width) > 0.01 * chart.width) return "–";
  return Number(chart.value(y[place]).toPrecision(3)).toString().replace("-", "−");
}

// The instant.

const slider = document.querySelector(".player input");
const clock = document.querySelector(".player output");

function show(time) {
  const share = (time - begin) / (end - begin);
  slider.value = time;
  clock.textContent = `${time.toFixed(2)} s`;
  for (const chart of charts) {
    chart.cursor.classList.add("on");
    chart.cursor.style.left = `${100 * share}%`;
    chart.traces.forEach((entry, number) => {
      chart.outputs[number].textContent = valueAt(chart, entry, share);
    });
  }
  if (flown) {
    now.points = [flown.points[nearest(times, time)]];
    draw(now);
  }
}

slider.addEventListener("input", () => show(Number(slider.value)));
for (const { plot } of charts) {
  plot.addEventListener("pointermove", (event) => {
    const box = plot.getBoundingClientRect();
    const share = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
    show(begin + share * (end - begin));
  });
}
page.classList.add("live");
