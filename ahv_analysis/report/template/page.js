"use strict";
// The plots of a page. All share one window of time: what moves one moves all.

const { flights, plots: drawings } = JSON.parse(document.getElementById("data").textContent);
const COLOURS = ["#2a78d0", "#d9542b", "#1f9d73", "#9256c8", "#c8901c", "#d0488f", "#5b8c1f", "#4aa3b8"];
const SHORTEST = 0.05; // [s] of a window
const HEIGHT = 190; // [px] of a plot
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const colour = (flight) => COLOURS[flight] ?? `hsl(${(flight * 137.5) % 360} 60% 50%)`;
const pretty = (value) => {
  if (value == null) return "";
  return Math.abs(value) < 1e-9 ? "0" : String(Number(value.toPrecision(6))).replace("-", "−");
};

function floats(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

const decode = (text) => Array.from(floats(text), (value) => (Number.isNaN(value) ? null : value)); // null is a gap

const times = flights.map((flight) => decode(flight.time));
const whole = {
  min: Math.min(...times.map((time) => time[0])),
  max: Math.max(...times.map((time) => time.at(-1))),
};
let shown = whole; // the window of time [s]
const charts = [];

function show(min, max) {
  const length = Math.min(Math.max(max - min, SHORTEST), whole.max - whole.min);
  const start = Math.min(Math.max(min, whole.min), whole.max - length);
  shown = { min: start, max: start + length };
  for (const chart of charts) chart.setScale("x", shown);
  place();
}

// Extremes in sight of each line up to a time [s] of its flight.
function extremes(drawing, chart, until) {
  let low = Infinity, high = -Infinity;
  const [time] = chart.data;
  drawing.lines.forEach((line, index) => {
    const end = Math.min(shown.max, until(flights[line.flight].lost ?? Infinity));
    const values = chart.data[index + 1];
    for (let i = 0; i < time.length && time[i] <= end; i++) {
      if (time[i] >= shown.min && values[i] != null) {
        low = Math.min(low, values[i]);
        high = Math.max(high, values[i]);
      }
    }
  });
  return [low, high];
}

// Scale to the flights that are never lost; where there are none, to all until they are lost, or
// after that to all; and to a bound within reach.
function fit(drawing, chart) {
  const choices = [(lost) => (lost < Infinity ? -Infinity : lost), (lost) => lost, () => Infinity];
  let [low, high] = choices.map((until) => extremes(drawing, chart, until)).find(([a, b]) => a <= b) ?? [0, 0];
  for (const bound of drawing.bounds ?? []) {
    const reached = bound < 0 ? low / bound : high / bound;
    if (reached > 0.5) [low, high] = [Math.min(low, bound), Math.max(high, bound)];
  }
  if (high - low < 1e-6) [low, high] = [low - 1, high + 1]; // nothing but rounding
  const margin = 0.06 * (high - low);
  return [low - margin, high + margin];
}

function drawBounds(drawing, chart) {
  const { ctx, bbox } = chart;
  ctx.save();
  ctx.strokeStyle = css("--bad");
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([2, 4].map((length) => length * devicePixelRatio));
  for (const bound of drawing.bounds ?? []) {
    if (bound < chart.scales.y.min || bound > chart.scales.y.max) continue;
    const y = Math.round(chart.valToPos(bound, "y", true));
    ctx.beginPath();
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
  }
  ctx.restore();
}

function series(drawing, line) {
  const alone = flights.length === 1;
  return {
    label: line.reference ? drawing.referenceName : "\u00a0", // the caption and the names above say the rest
    class: !alone && line.reference ? "unlisted" : undefined,
    stroke: alone && line.reference ? COLOURS[1] : colour(line.flight),
    width: line.reference ? 1.2 : 1.6,
    dash: line.reference ? [5, 4] : undefined,
    alpha: !alone && line.reference ? 0.6 : 1,
    points: { show: false },
    paths: drawing.held ? uPlot.paths.stepped({ align: 1 }) : undefined,
    pxAlign: 0,
    value: (chart, value) => pretty(value),
  };
}

function axis(size, values) {
  return {
    stroke: () => css("--muted"),
    grid: { stroke: () => css("--line"), width: 1 },
    ticks: { show: false },
    font: "11px system-ui, sans-serif",
    gap: 4,
    size,
    values,
  };
}

function data(drawing) {
  const tables = flights.map((flight, index) => [
    times[index],
    ...drawing.lines.filter((line) => line.flight === index).map((line) => decode(line.values)),
  ]);
  return tables.length === 1 ? tables[0] : uPlot.join(tables.filter((table) => table.length > 1));
}

function build(figure) {
  const drawing = drawings[figure.dataset.plot];
  const chart = new uPlot(
    {
      width: figure.clientWidth,
      height: HEIGHT,
      legend: { mount: (chart, legend) => figure.querySelector("figcaption").append(legend) },
      cursor: {
        // hovering is shared; zooming is by `show`
        sync: { key: "time", setSeries: false, filters: { pub: (type) => type.startsWith("mousemove") || type === "mouseleave" } },
        drag: { x: true, y: false, dist: 4 },
        bind: { mousedown: (chart, target, handler) => (event) => event.shiftKey || handler(event) },
        points: { size: 6 },
      },
      scales: { x: { time: false }, y: { range: (chart) => fit(drawing, chart) } },
      axes: [
        axis(26, (chart, marks) => marks.map((mark) => `${mark} s`)),
        axis(54, (chart, marks) => marks.map((mark) => String(mark).replace("-", "−"))),
      ],
      series: [{ label: "time" }, ...drawing.lines.map((line) => series(drawing, line))],
      hooks: {
        drawClear: [(chart) => drawBounds(drawing, chart)],
        setScale: [(chart, key) => key === "x" && follow(chart)],
        setCursor: [readOff],
      },
    },
    data(drawing),
    figure,
  );
  charts.push(chart);
  figure.addEventListener("keydown", steer);
  const canvas = chart.root.querySelector("canvas"); // to those who do not see it the readings beside it say more
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `Curves of ${drawing.name} over time`);
  handle(chart);
  new ResizeObserver(() => chart.setSize({ width: figure.clientWidth, height: HEIGHT })).observe(figure);
}

// A zoom that began in one chart (a dragged window, a double-click) goes to all.
function follow(chart) {
  const { min, max } = chart.scales.x;
  if (charts.includes(chart) && (min !== shown.min || max !== shown.max)) show(min, max);
}

// Two fingers pinch and pan, as does a mouse with Shift; one finger reads off.
function handle(chart) {
  const over = chart.over;
  const held = new Map(); // pointer: time [s] under it when the gesture began
  const now = new Map(); // pointer: position [px]
  const position = (event) => event.clientX - over.getBoundingClientRect().left;
  const begin = () => now.forEach((x, pointer) => held.set(pointer, chart.posToVal(x, "x")));

  over.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "mouse" && !event.shiftKey) return;
    over.setPointerCapture(event.pointerId);
    now.set(event.pointerId, position(event));
    begin();
  });
  over.addEventListener("pointermove", (event) => {
    if (!now.has(event.pointerId)) return;
    now.set(event.pointerId, position(event));
    const pointers = [...now.keys()];
    if (pointers.length === 1 && event.pointerType !== "mouse") {
      const time = chart.posToVal(now.get(pointers[0]), "x");
      seek(time);
      return;
    }
    const [a, b] = pointers.map((pointer) => ({ x: now.get(pointer), time: held.get(pointer) }));
    const apart = b && Math.abs(b.x - a.x) > 8 && b.time !== a.time;
    const slope = apart ? (b.time - a.time) / (b.x - a.x) : (shown.max - shown.min) / over.clientWidth;
    if (slope > 0) show(a.time - a.x * slope, a.time + (over.clientWidth - a.x) * slope);
  });
  for (const type of ["pointerup", "pointercancel"]) {
    over.addEventListener(type, (event) => {
      now.delete(event.pointerId);
      held.delete(event.pointerId);
      begin();
    });
  }
  over.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    const time = chart.posToVal(position(event), "x");
    const factor = Math.exp(event.deltaY * 0.003);
    show(time - (time - shown.min) * factor, time + (shown.max - time) * factor);
  }, { passive: false });
}
