// Charts: hover to read, drag to zoom, two fingers or Ctrl and wheel to zoom, double-click for the whole flight.

const LEAST_DRAG_PX = 5;

function timeAt(plot, clientX) {
  const box = plot.getBoundingClientRect();
  return shown.begin + clamped((clientX - box.left) / box.width, 0, 1) * (shown.end - shown.begin);
}

/** Keep the two times that were first touched under the two fingers. */
function pinch(plot, held, fingers) {
  const box = plot.getBoundingClientRect();
  const [a, b] = fingers.map((finger) => (finger.x - box.left) / box.width);
  if (Math.abs(b - a) < 0.02) return;
  const length = (held[1] - held[0]) / (b - a);
  if (length <= 0) return;
  const begin = held[0] - a * length;
  setWindow(begin, begin + length);
}

function listen(plot) {
  const fingers = new Map();
  let held = null; // times under two fingers
  let drag = null; // where a mouse began to mark a stretch
  const marked = document.createElement("i");
  marked.className = "marked";

  function showMarked(clientX) {
    const box = plot.getBoundingClientRect();
    const [left, right] = [drag, clientX].map((x) => clamped(x - box.left, 0, box.width)).sort((a, b) => a - b);
    marked.style.cssText = `left:${left}px;width:${right - left}px`;
    if (!marked.isConnected) plot.append(marked);
  }

  plot.addEventListener("pointerdown", (event) => {
    fingers.set(event.pointerId, { x: event.clientX });
    if (event.pointerType === "mouse") {
      if (event.button !== 0) return;
      plot.setPointerCapture(event.pointerId);
      drag = event.clientX;
    } else if (fingers.size === 2) held = [...fingers.values()].map((finger) => timeAt(plot, finger.x));
    setInstant(timeAt(plot, event.clientX));
  });
  plot.addEventListener("pointermove", (event) => {
    if (fingers.has(event.pointerId)) fingers.get(event.pointerId).x = event.clientX;
    if (held && fingers.size === 2) pinch(plot, held, [...fingers.values()]);
    else if (!held) setInstant(timeAt(plot, event.clientX));
    if (drag !== null) showMarked(event.clientX);
  });
  const release = (event) => {
    fingers.delete(event.pointerId);
    if (!fingers.size) held = null;
    if (drag !== null && event.type === "pointerup" && Math.abs(event.clientX - drag) > LEAST_DRAG_PX) {
      const [begin, end] = [timeAt(plot, drag), timeAt(plot, event.clientX)].sort((a, b) => a - b);
      setWindow(begin, end);
    }
    drag = null;
    marked.remove();
  };
  plot.addEventListener("pointerup", release);
  plot.addEventListener("pointercancel", release);
  plot.addEventListener("dblclick", () => setWindow(whole.begin, whole.end));
  plot.addEventListener(
    "wheel",
    (event) => {
      const sideways = Math.abs(event.deltaX) > Math.abs(event.deltaY) && zoomed();
      if (!event.ctrlKey && !sideways) return; // plain turning of the wheel scrolls the page
      event.preventDefault();
      if (sideways) pan(event.deltaX / plot.clientWidth);
      else zoom(Math.exp(event.deltaY * 0.004), timeAt(plot, event.clientX));
    },
    { passive: false },
  );
}

for (const { plot } of charts) listen(plot);
