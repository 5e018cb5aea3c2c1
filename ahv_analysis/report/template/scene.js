"use strict";
// The view in three dimensions: draws one of its two pictures whenever time or camera moves.

const DEG = 180 / Math.PI;
const signed = (value, digits) => value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1").replace("-", "−");
const READINGS = {
  h: (now) => `${(now.h / 1000).toFixed(3)} km`,
  error: (now) => ("reference" in now ? `${signed(now.h - now.reference, 0)} m` : "–"),
  mach: (now) => now.mach.toFixed(2),
  alpha: (now) => `${signed(now.alpha * DEG, 2)}°`,
  beta: (now) => `${signed(now.beta * DEG, 2)}°`,
  lift: (now) => `${signed(now.lift, 2)} weights`,
  throttle: (now) => now.throttle.toFixed(2),
  right_elevon: (now) => `${signed(now.right_elevon * DEG, 1)}°`,
  left_elevon: (now) => `${signed(now.left_elevon * DEG, 1)}°`,
  rudder: (now) => `${signed(now.rudder * DEG, 1)}°`,
};

class Stage {
  constructor(panel, context, content) {
    this.canvas = panel.querySelector("canvas");
    this.labels = panel.querySelector(".labels");
    this.noteOf = panel.querySelector(".view-note");
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, context, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    const motions = content.flights.map((channels) => new Motion(channels));
    const paints = motions.map((_, index) => new THREE.Color(colour(index)));
    this.motions = motions;
    this.views = { near: new NearView(motions, paints, content.vehicle), path: new PathView(motions, paints, content.vehicle) };
    this.scene = new THREE.Scene();
    this.sun = new THREE.DirectionalLight("#ffffff", 2.2);
    this.sun.position.set(-0.4, 1, 0.6);
    this.scene.add(this.sun, new THREE.HemisphereLight("#ffffff", "#7d8790", 1.6));
    for (const view of Object.values(this.views)) this.scene.add(view.group);
    this.waiting = false;
    this.choose("near");
    turnable(this.canvas, () => this.view.camera, () => this.ask());
    new ResizeObserver(() => this.ask()).observe(this.canvas.parentElement);
  }

  choose(name) {
    this.view = this.views[name];
    for (const [other, view] of Object.entries(this.views)) view.group.visible = other === name;
    this.scene.fog = name === "near" ? new THREE.Fog(css("--paper"), 700, 3600) : null;
    this.noteOf.textContent = this.view.note();
    this.ask();
  }

  // A picture with the next frame, however often it is asked for.
  ask() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== width || size.y !== height) this.renderer.setSize(width, height, false);
    if (this.scene.fog) this.scene.fog.color.set(css("--paper"));
    this.view.show(cursor.time);
    const eye = this.view.camera.look(width / height);
    this.scene.updateMatrixWorld();
    this.renderer.render(this.scene, eye);
    this.label(eye, width, height);
    this.drawn = cursor.time;
  }

  label(eye, width, height) {
    const wanted = this.view.labels();
    while (this.labels.children.length < wanted.length) this.labels.append(document.createElement("span"));
    [...this.labels.children].forEach((span, index) => {
      const [words, place] = wanted[index] ?? ["", new THREE.Vector3()];
      const { x, y, z } = place.clone().project(eye);
      span.textContent = Math.abs(x) < 1 && Math.abs(y) < 1 && z < 1 ? words : "";
      span.style.transform = `translate(${((x + 1) / 2) * width}px, ${((1 - y) / 2) * height}px) translate(-50%, -50%)`;
    });
  }
}

function readings(panel, motions) {
  const cells = [...panel.querySelectorAll("[data-reading]")];
  return (time) => {
    const moments = motions.map((motion) => motion.at(time));
    for (const cell of cells) cell.textContent = READINGS[cell.dataset.reading](moments[cell.dataset.flight]);
    for (const cell of panel.querySelectorAll("[data-state]")) {
      const { lost } = flights[cell.dataset.state], ended = time > motions[cell.dataset.state].last + 1e-6;
      const tumbles = lost != null && time >= lost;
      cell.textContent = tumbles ? `lost at ${lost.toFixed(2)} s` : ended ? "ended" : "in flight";
      cell.classList.toggle("bad", tumbles);
    }
  };
}

// Buttons, speed and slider; every one of them is worked by keys as well.
function controls(panel, stage) {
  const button = panel.querySelector(".play"), slider = panel.querySelector("input");
  button.addEventListener("click", () => play(!cursor.playing));
  slider.min = whole.min;
  slider.max = whole.max;
  slider.addEventListener("input", () => seek(Number(slider.value)));
  panel.querySelector("select").addEventListener("change", (event) => (cursor.speed = Number(event.target.value)));
  for (const choice of panel.querySelectorAll("[data-view]")) {
    choice.addEventListener("click", () => {
      for (const other of panel.querySelectorAll("[data-view]")) other.setAttribute("aria-pressed", other === choice);
      stage.choose(choice.dataset.view);
    });
  }
  panel.querySelector(".camera").addEventListener("click", () => {
    stage.view.camera.reset();
    stage.ask();
  });
  return (time) => {
    button.textContent = cursor.playing ? "Pause" : "Play";
    slider.value = time;
    slider.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds`);
  };
}

let stage = null; // stays so where there is no WebGL

function openScene() {
  const panel = document.getElementById("flight"), content = JSON.parse(document.getElementById("scene").textContent);
  const canvas = panel.querySelector("canvas");
  const context = canvas.getContext("webgl2", { antialias: true, alpha: true });
  const give = () => panel.classList.add("without");
  if (!context) return give();
  stage = new Stage(panel, context, content);
  canvas.addEventListener("webglcontextlost", give);
  canvas.addEventListener("webglcontextrestored", () => panel.classList.remove("without"));
  cursor.followers.push(() => stage.ask(), readings(panel, stage.motions), controls(panel, stage));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => stage.ask());
}
