"use strict";
// A camera that looks at the origin: turned and brought nearer by mouse, fingers and keys.

class Orbit {
  constructor(start) {
    this.start = start;
    this.heading = 0; // [rad] of what it looks at: it turns with it
    this.eye = new THREE.PerspectiveCamera(40, 1, start.nearest / 30, start.farthest * 4);
    this.reset();
  }

  reset() {
    Object.assign(this, { azimuth: this.start.azimuth, elevation: this.start.elevation, distance: this.start.distance });
  }

  turn(aside, up) {
    this.azimuth += aside;
    this.elevation = Math.min(Math.max(this.elevation + up, -1.5), 1.5);
  }

  approach(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, this.start.nearest), this.start.farthest);
  }

  look(aspect) {
    const round = this.azimuth + this.heading, level = this.distance * Math.cos(this.elevation);
    const far = aspect < 1 ? 1 / aspect : 1; // a narrow picture shows as much from further off
    this.eye.aspect = aspect;
    this.eye.position.set(level * Math.cos(round), this.distance * Math.sin(this.elevation), level * Math.sin(round)).multiplyScalar(far);
    this.eye.lookAt(0, 0, 0);
    this.eye.updateProjectionMatrix();
    this.eye.updateMatrixWorld();
    return this.eye;
  }
}

// Have a canvas turn the camera that `orbit()` gives, and call `moved` after that.
function turnable(canvas, orbit, moved) {
  const held = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, event);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    const others = [...held.values()].filter((one) => one.pointerId !== event.pointerId);
    if (others.length) {
      const apart = (one) => Math.hypot(one.clientX - others[0].clientX, one.clientY - others[0].clientY) || 1;
      orbit().approach(apart(before) / apart(event));
    } else {
      orbit().turn((event.clientX - before.clientX) * 0.008, (event.clientY - before.clientY) * 0.008);
    }
    held.set(event.pointerId, event);
    moved();
  });
  for (const type of ["pointerup", "pointercancel"]) canvas.addEventListener(type, (event) => held.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return; // the page scrolls by the wheel alone
    event.preventDefault();
    orbit().approach(Math.exp(event.deltaY * 0.002));
    moved();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const doings = {
      ArrowLeft: () => orbit().turn(-0.1, 0),
      ArrowRight: () => orbit().turn(0.1, 0),
      ArrowUp: () => orbit().turn(0, 0.1),
      ArrowDown: () => orbit().turn(0, -0.1),
      "+": () => orbit().approach(0.85),
      "=": () => orbit().approach(0.85),
      "-": () => orbit().approach(1 / 0.85),
      0: () => orbit().reset(),
      " ": () => play(!cursor.playing),
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !doings[event.key]) return;
    event.preventDefault();
    doings[event.key]();
    moved();
  });
}
