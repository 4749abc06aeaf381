// Charts: the window of time, the instant, and (where asked for) values that fill the height.

const COLUMNS = 500; // stretches of a line that keep their least and greatest value each
let fitted = false;

const charts = [...document.querySelectorAll(".plot svg[data-low]")].map((svg) => {
  const plot = svg.parentElement;
  const chart = plot.closest(".chart");
  return {
    svg,
    plot,
    numbers: [...svg.querySelectorAll(".trace")].map((group) => groups.indexOf(group)),
    outputs: [...chart.querySelectorAll("output")],
    cursor: plot.querySelector(".cursor"),
    words: [...plot.querySelectorAll("span[data-value]")],
    scale: chart.querySelector(".scale"),
    grid: svg.querySelector(".grid"),
    log: "log" in svg.dataset,
    low: Number(svg.dataset.low),
    high: Number(svg.dataset.high),
    width: svg.viewBox.baseVal.width,
    height: svg.viewBox.baseVal.height,
    drawn: "", // which window its lines were drawn for
    visible: true,
  };
});

function shareOf(chart, value) {
  const { low, high, log } = chart;
  return log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
}

function heightOf(chart, value) {
  return (1 - clamped(shareOf(chart, value), 0, 1)) * chart.height;
}

/** The points of one trace in the window, a list for each stretch without gaps. */
function linesOf(chart, { times, values }) {
  const first = Math.max(firstAt(times, shown.begin) - 1, 0);
  const last = Math.min(firstAt(times, shown.end) + 1, times.length);
  const width = Math.max(1, Math.ceil((last - first) / COLUMNS));
  const lines = [[]];
  for (let bin = first; bin < last; bin += width) {
    for (const n of extremes(values, bin, Math.min(bin + width, last))) {
      if (Number.isNaN(values[n])) {
        if (lines.at(-1).length) lines.push([]);
        continue;
      }
      const x = ((times[n] - whole.begin) / (whole.end - whole.begin)) * chart.width;
      lines.at(-1).push(`${x.toFixed(3)},${heightOf(chart, values[n]).toFixed(2)}`);
    }
  }
  return lines.filter((line) => line.length);
}

/** The places of the least and the greatest value between two places, in order; of a gap, its first. */
function extremes(values, begin, end) {
  let low = -1;
  let high = -1;
  for (let n = begin; n < end; n += 1) {
    if (Number.isNaN(values[n])) continue;
    if (low < 0 || values[n] < values[low]) low = n;
    if (high < 0 || values[n] > values[high]) high = n;
  }
  if (low < 0) return [begin];
  return low === high ? [low] : [Math.min(low, high), Math.max(low, high)];
}

function drawLines(chart) {
  const key = `${shown.begin} ${shown.end} ${document.body.classList.contains("fine")}`;
  if (chart.drawn === key || !chart.visible) return;
  chart.drawn = key;
  for (const number of chart.numbers) {
    const lines = linesOf(chart, samples[number]);
    groups[number].replaceChildren(
      ...lines.map((points) => {
        const line = document.createElementNS("http://www.w3.org/2000/svg", "polyline");
        line.setAttribute("points", points.join(" "));
        return line;
      }),
    );
  }
}

/** The values to show: the whole axis, or what the window holds. */
function levelsOf(chart) {
  if (!fitted) return { low: chart.low, high: chart.high };
  let low = Infinity;
  let high = -Infinity;
  for (const number of chart.numbers) {
    if (groups[number].classList.contains("off")) continue;
    const { times, values } = samples[number];
    for (let n = firstAt(times, shown.begin); n < times.length && times[n] <= shown.end; n += 1) {
      if (values[n] < low) low = values[n];
      if (values[n] > high) high = values[n];
    }
  }
  if (low > high) return { low: chart.low, high: chart.high };
  const lowShare = clamped(shareOf(chart, low), 0, 1);
  const highShare = clamped(shareOf(chart, high), 0, 1);
  const margin = Math.max(0.06 * (highShare - lowShare), 0.004);
  const value = (share) =>
    chart.log ? chart.low * (chart.high / chart.low) ** share : chart.low + (chart.high - chart.low) * share;
  return { low: value(lowShare - margin), high: value(highShare + margin) };
}

/** The drawing's view box is the window; numbers and words beside it are put where they belong. */
function place(chart) {
  const levels = levelsOf(chart);
  const top = (1 - shareOf(chart, levels.high)) * chart.height;
  const bottom = (1 - shareOf(chart, levels.low)) * chart.height;
  const scale = chart.width / (whole.end - whole.begin);
  const left = (shown.begin - whole.begin) * scale;
  chart.svg.setAttribute("viewBox", `${left} ${top} ${(shown.end - shown.begin) * scale} ${bottom - top}`);
  const height = (value) => (100 * (bottom - (1 - shareOf(chart, value)) * chart.height)) / (bottom - top);
  for (const word of chart.words) {
    const at = height(Number(word.dataset.value));
    word.style.bottom = `${at}%`;
    word.hidden = at < -1 || at > 101;
  }
  const key = `${levels.low} ${levels.high}`;
  if (chart.levels === key) return;
  chart.levels = key;
  const values = ticks(levels.low, levels.high, chart.log, 4);
  chart.scale.replaceChildren(...values.map((value) => mark(label(value), `bottom:${height(value)}%`)));
  chart.grid.replaceChildren(...values.map((value) => gridLine(chart, value)));
}

function mark(text, style) {
  const span = document.createElement("span");
  span.textContent = text;
  span.style.cssText = style;
  return span;
}

function gridLine(chart, value) {
  const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
  const y = (1 - shareOf(chart, value)) * chart.height;
  for (const [name, number] of Object.entries({ x1: 0, x2: chart.width, y1: y, y2: y })) line.setAttribute(name, number);
  return line;
}

/** To a thousandth of the axis, or to three digits where it is logarithmic. */
function readOut(chart, value) {
  if (Number.isNaN(value)) return "–";
  if (chart.log) return label(Number(value.toPrecision(3)));
  const digits = clamped(Math.ceil(-Math.log10((chart.high - chart.low) / 1000)), 0, 6);
  return label(Number(value.toFixed(digits)));
}

function drawCursor(chart) {
  const share = across(instant);
  chart.cursor.classList.toggle("on", share >= 0 && share <= 1);
  chart.cursor.style.left = `${100 * share}%`;
  chart.numbers.forEach((number, n) => {
    const value = valueAt(samples[number], instant);
    chart.outputs[n].textContent = readOut(chart, value);
  });
}

/** Show the name of a stretch `room` px wide only where it fits. */
function showName(span, room) {
  const name = span.firstChild;
  name.hidden = false;
  name.hidden = name.offsetWidth + 8 > room;
}

/** Names of phases over their stretches. */
function placeNames(names) {
  const room = names.clientWidth;
  for (const span of names.children) {
    const begin = clamped(across(Number(span.dataset.begin)), 0, 1);
    const end = clamped(across(Number(span.dataset.end)), 0, 1);
    span.style.left = `${100 * begin}%`;
    span.style.width = `${100 * (end - begin)}%`;
    span.hidden = end <= begin;
    showName(span, (end - begin) * room);
  }
}

function placeTimes(times) {
  const values = ticks(shown.begin, shown.end, false, times.clientWidth < 420 ? 4 : 6);
  times.replaceChildren(
    ...values.map((value, n) => {
      const span = mark(n === values.length - 1 ? `${label(value)} s` : label(value), `left:${100 * across(value)}%`);
      span.classList.toggle("end", across(value) > 0.95);
      return span;
    }),
  );
}

// A legend's entry switches its line off and on.
for (const chart of charts) {
  chart.outputs.forEach((output, n) => {
    output.parentElement.addEventListener("click", () => {
      const off = output.parentElement.classList.toggle("off");
      groups[chart.numbers[n]].classList.toggle("off", off);
      changed();
    });
  });
}

const nameRows = [...document.querySelectorAll(".chart .phases")];
const timeRows = [...document.querySelectorAll('.times[data-unit="s"]')];
let placed = "";

follow(() => {
  const key = `${shown.begin} ${shown.end} ${innerWidth}`;
  for (const chart of charts) {
    drawLines(chart);
    place(chart);
    drawCursor(chart);
  }
  if (placed === key) return;
  placed = key;
  nameRows.forEach(placeNames);
  timeRows.forEach(placeTimes);
});

// Lines are drawn anew where they can be seen, and elsewhere when they come into sight.
const sight = new IntersectionObserver(
  (entries) => {
    for (const { target, isIntersecting } of entries) {
      charts.find((chart) => chart.plot === target).visible = isIntersecting;
    }
    changed();
  },
  { rootMargin: "300px" },
);
for (const { plot } of charts) sight.observe(plot);
addEventListener("resize", changed);
