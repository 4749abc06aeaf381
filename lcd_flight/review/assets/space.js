// The path: turned, zoomed, and played. The same projection as lcd_flight/review/view.py.

const space = document.querySelector(".space");
const canvas = space.viewBox.baseVal;
const center = space.dataset.center.split(",").map(Number);
const home = {
  azimuth: Number(space.dataset.azimuth),
  elevation: Number(space.dataset.elevation),
  scale: Number(space.dataset.scale),
  right: 0,
  down: 0,
};
const view = { ...home };
const ARM_SHARE = 0.022; // of the drawing's width, so that any vehicle is seen
const MOST_PATH_POINTS = 1500;
let viewChanged = true;
let playedWindow = "";

// The whole path stays behind, faint, where the strong line is cut to the window.
for (const path of space.querySelectorAll(".path")) {
  const rest = path.cloneNode();
  rest.classList.replace("path", "rest");
  path.before(rest);
}
const shapes = [...space.querySelectorAll("[data-xyz]")].map((element) => ({
  element,
  points: element.dataset.xyz.split(" ").map((point) => point.split(",").map(Number)),
}));
const paths = shapes.filter((shape) => shape.element.matches(".path"));
const vehicles = [...space.querySelectorAll(".now")].map((group) => ({
  flight: group.dataset.flight,
  lines: [...group.querySelectorAll("polyline")],
  target: group.querySelector(".target"),
  dot: group.querySelector("circle:not(.target)"),
}));
for (const path of paths) path.all = path.points;

function project(point) {
  const [x, y, z] = point.map((value, axis) => value - center[axis]);
  const right = x * Math.cos(view.azimuth) - y * Math.sin(view.azimuth);
  const away = x * Math.sin(view.azimuth) + y * Math.cos(view.azimuth);
  const up = z * Math.cos(view.elevation) + away * Math.sin(view.elevation);
  return [canvas.width / 2 + view.scale * right + view.right, canvas.height / 2 - view.scale * up + view.down];
}

function projected(points) {
  return points.map((point) => project(point).map((place) => place.toFixed(1)).join(",")).join(" ");
}

function drawShape({ element, points }) {
  const places = projected(points);
  if (element.tagName === "polyline") element.setAttribute("points", places);
  else element.setAttribute("transform", `translate(${places})`);
}

/** Where a flight is, in mm; null where that is not known. */
function positionOf(flight, of, time) {
  const point = ["x", "y", "z"].map((axis) => 1000 * smoothAt(`${flight}/${of}${axis}`, time));
  return point.some(Number.isNaN) ? null : point;
}

/** Columns of the rotation from body to world: about z by the yaw, then y by the pitch, then x by the roll. */
function attitudeOf(flight, time) {
  const [a, b, c] = ["roll", "pitch", "yaw"].map((name) => ((smoothAt(`${flight}/${name}`, time) || 0) * Math.PI) / 180);
  const [sa, sb, sc] = [a, b, c].map(Math.sin);
  const [ca, cb, cc] = [a, b, c].map(Math.cos);
  return [
    [cc * cb, sc * cb, -sb],
    [cc * sb * sa - sc * ca, sc * sb * sa + cc * ca, cb * sa],
    [cc * sb * ca + sc * sa, sc * sb * ca - cc * sa, cb * ca],
  ];
}

function drawVehicle({ flight, lines, target, dot }) {
  const at = positionOf(flight, "", instant);
  if (!at) return;
  const arm = (ARM_SHARE * canvas.width) / view.scale;
  const [forward, left, up] = attitudeOf(flight, instant);
  const from = (u, v, w) => at.map((value, n) => value + arm * (u * forward[n] + v * left[n] + w * up[n]));
  const goal = positionOf(flight, "reference-", instant);
  const [gap, one, other, nose, thrust] = lines;
  gap.setAttribute("points", goal ? projected([at, goal]) : "");
  one.setAttribute("points", projected([from(0.7, 0.7, 0), from(-0.7, -0.7, 0)]));
  other.setAttribute("points", projected([from(0.7, -0.7, 0), from(-0.7, 0.7, 0)]));
  nose.setAttribute("points", projected([at, from(0.9, 0, 0)]));
  thrust.setAttribute("points", projected([at, from(0, 0, 1)]));
  moveTo(dot, at);
  target.setAttribute("display", goal ? "inline" : "none");
  if (goal) moveTo(target, goal);
}

function moveTo(circle, point) {
  const [x, y] = project(point);
  circle.setAttribute("cx", x.toFixed(1));
  circle.setAttribute("cy", y.toFixed(1));
}

/** The strong line is the window's part of the path. */
function cutPath(path) {
  const number = byRole.get(`${path.element.dataset.flight}/x`);
  if (!zoomed() || number === undefined) {
    path.points = path.all;
    return;
  }
  const { times } = samples[number];
  const first = firstAt(times, shown.begin);
  const last = firstAt(times, shown.end);
  const step = Math.max(1, Math.ceil((last - first) / MOST_PATH_POINTS));
  const within = [];
  for (let n = first; n < last; n += step) within.push(positionOf(path.element.dataset.flight, "", times[n]));
  path.points = within.filter(Boolean);
}

follow(() => {
  const key = `${shown.begin} ${shown.end} ${document.body.classList.contains("fine")}`;
  if (playedWindow !== key) {
    playedWindow = key;
    for (const path of paths) {
      cutPath(path);
      drawShape(path);
    }
  }
  if (viewChanged) shapes.forEach(drawShape);
  viewChanged = false;
  vehicles.forEach(drawVehicle);
});

function look(change) {
  Object.assign(view, change);
  view.elevation = clamped(view.elevation, 0, Math.PI / 2);
  view.scale = clamped(view.scale, home.scale / 4, home.scale * 40);
  viewChanged = true;
  changed();
}

/** Nearer by a factor; the place (in the drawing) stays where it is. */
function approach(factor, x = canvas.width / 2, y = canvas.height / 2) {
  const scale = clamped(view.scale * factor, home.scale / 4, home.scale * 40);
  const by = scale / view.scale;
  const [dx, dy] = [x - canvas.width / 2, y - canvas.height / 2];
  look({ scale, right: dx - (dx - view.right) * by, down: dy - (dy - view.down) * by });
}

const held = new Map();

function spread() {
  const [a, b] = [...held.values()];
  return { size: Math.hypot(a.x - b.x, a.y - b.y), x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 };
}

/** From the screen to the drawing. */
function inDrawing(clientX, clientY) {
  const box = space.getBoundingClientRect();
  const share = canvas.width / box.width;
  return [(clientX - box.left) * share, (clientY - box.top) * share, share];
}

space.addEventListener("pointerdown", (event) => {
  space.setPointerCapture(event.pointerId);
  held.set(event.pointerId, { x: event.clientX, y: event.clientY });
});
space.addEventListener("pointermove", (event) => {
  const finger = held.get(event.pointerId);
  if (!finger) return;
  const [dx, dy] = [event.clientX - finger.x, event.clientY - finger.y];
  const before = held.size === 2 ? spread() : null;
  Object.assign(finger, { x: event.clientX, y: event.clientY });
  if (before) {
    const after = spread();
    const [x, y, share] = inDrawing(after.x, after.y);
    approach(after.size / Math.max(before.size, 1), x, y);
    look({ right: view.right + (after.x - before.x) * share, down: view.down + (after.y - before.y) * share });
  } else if (event.shiftKey) {
    const share = inDrawing(0, 0)[2];
    look({ right: view.right + dx * share, down: view.down + dy * share });
  } else look({ azimuth: view.azimuth - dx * 0.008, elevation: view.elevation + dy * 0.008 });
});
for (const end of ["pointerup", "pointercancel"]) {
  space.addEventListener(end, (event) => held.delete(event.pointerId));
}
space.addEventListener("dblclick", () => look(home));
space.addEventListener(
  "wheel",
  (event) => {
    if (!event.ctrlKey) return; // plain turning of the wheel scrolls the page
    event.preventDefault();
    const [x, y] = inDrawing(event.clientX, event.clientY);
    approach(Math.exp(-event.deltaY * 0.004), x, y);
  },
  { passive: false },
);
