"use strict";
// One time cursor for the plots and the view in three dimensions, and the clock that moves it.

const PLOTS_EVERY = 50; // [ms] between moves of the plots' cursors while time runs
const cursor = {
  time: whole.min, // [s]
  speed: 1, // seconds of flight in a second
  playing: false,
  followers: [], // called with the time after every move
};

function seek(time) {
  cursor.time = Math.min(Math.max(time, whole.min), whole.max);
  for (const follower of cursor.followers) follower(cursor.time);
}

function play(on) {
  if (on === cursor.playing) return;
  cursor.playing = on;
  if (on && cursor.time >= whole.max) seek(whole.min);
  let before = performance.now();
  const tick = (now) => {
    if (!cursor.playing) return;
    const time = cursor.time + (Math.max(0, now - before) / 1000) * cursor.speed;
    before = now;
    if (time >= whole.max) cursor.playing = false;
    seek(time);
    if (cursor.playing) requestAnimationFrame(tick);
  };
  if (on) requestAnimationFrame(tick);
  seek(cursor.time);
}

// The plots' own cursors, which a mouse over one of them moves as well.
let placing = false;
let placed = 0; // [ms] when they last were

function place() {
  placing = true;
  placed = performance.now();
  const seen = cursor.time >= shown.min && cursor.time <= shown.max;
  for (const chart of charts) chart.setCursor({ left: seen ? chart.valToPos(cursor.time, "x") : -10, top: -1 });
  placing = false;
}

cursor.followers.push((time) => {
  document.getElementById("cursor").textContent = `t = ${time.toFixed(2)} s`;
  if (!cursor.playing || performance.now() - placed > PLOTS_EVERY) place();
});

// While time runs a mouse over a plot does not hold it.
function readOff(chart) {
  if (placing || cursor.playing || !charts.includes(chart)) return;
  const { left, idx } = chart.cursor;
  if (left >= 0 && idx != null && chart.over.matches(":hover")) seek(chart.data[0][idx]);
}

// Keys on a plot: arrows move the cursor, plus and minus zoom about it, Home and End go to the ends.
function steer(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const span = shown.max - shown.min;
  const step = Math.max(0.01, event.shiftKey ? span / 10 : span / 200);
  const about = Math.min(Math.max(cursor.time, shown.min), shown.max);
  const zoom = (factor) => show(about - (about - shown.min) * factor, about + (shown.max - about) * factor);
  const doings = {
    ArrowLeft: () => seek(cursor.time - step),
    ArrowRight: () => seek(cursor.time + step),
    Home: () => seek(shown.min),
    End: () => seek(shown.max),
    "+": () => zoom(0.5),
    "=": () => zoom(0.5),
    "-": () => zoom(2),
    0: () => show(whole.min, whole.max),
    " ": () => play(!cursor.playing),
  };
  if (!doings[event.key]) return;
  event.preventDefault();
  doings[event.key]();
}
