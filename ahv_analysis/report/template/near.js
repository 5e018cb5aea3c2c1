"use strict";
// The view of the vehicle: it stands still and the world moves, so that no number grows large.

const LASTS = 6; // [s] of trail behind the vehicle
const MOMENTS = 240; // of that trail
const CELL = 200; // [m] of the grid at the altitude to follow
const CELLS = 34;

class NearView {
  constructor(motions, paints, parts) {
    this.motions = motions;
    this.camera = new Orbit({ azimuth: 2.45, elevation: 0.28, distance: 105, nearest: 30, farthest: 3000 });
    this.group = new THREE.Group();
    this.vehicles = motions.map((_, index) => new Vehicle(parts, motions.length > 1 ? paints[index] : "#c9d1d9"));
    this.airs = motions.map(() => new AirVectors());
    this.trails = motions.map((_, index) => new Trail(MOMENTS, paints[index]));
    this.grid = grid();
    this.ghosts = motions.map(() => ghost());
    this.group.add(this.grid);
    motions.forEach((_, index) => {
      this.vehicles[index].group.add(this.airs[index].group);
      this.group.add(this.vehicles[index].group, this.trails[index].group, this.ghosts[index]);
    });
  }

  show(time) {
    this.motions.forEach((motion, index) => {
      const now = motion.at(time);
      this.vehicles[index].show(now);
      this.airs[index].show(now);
      this.ghosts[index].quaternion.copy(attitude(now.phi_command, now.theta_command, now.psi_command));
      const ended = Math.min(time, motion.last), points = [], heights = [];
      for (let k = 0; k < MOMENTS; k++) {
        const moment = ended - (LASTS * k) / (MOMENTS - 1);
        if (moment < motion.time[0] && k > 0) break;
        const then = motion.at(moment);
        points.push([then.x - now.x, then.h - now.h, then.y - now.y]);
        heights.push(then.reference - now.h);
      }
      this.trails[index].draw(points, motion.followsAltitude ? heights : null);
      if (index > 0) return;
      const behind = points[Math.min(10, points.length - 1)];
      if (Math.hypot(behind[0], behind[2]) > 1) this.camera.heading = Math.atan2(-behind[2], -behind[0]);
      this.grid.visible = motion.followsAltitude;
      const part = (value) => value - CELL * Math.round(value / CELL);
      this.grid.position.set(-part(now.x), now.reference - now.h, -part(now.y));
    });
  }

  // Words at places of the scene.
  labels() {
    const air = this.airs[0], { quaternion } = this.vehicles[0].group;
    const shown = Object.entries(air.tips).filter(([words]) => words !== "β" || air.slips);
    return shown.map(([words, tip]) => [words, tip.clone().applyQuaternion(quaternion)]);
  }

  note() {
    const overlaid = this.motions.length > 1 ? " All vehicles stand in one place, so that attitudes compare; their paths do in the other view." : "";
    const grid = this.motions[0].followsAltitude ? " The grid, of 200 m, lies at the altitude to follow; the ribbon is the way to it." : "";
    return `Thin lines: the commanded attitude. α and β are drawn ${ANGLES_DRAWN} times as large up to 6°; the lift is the model’s.${grid}${overlaid}`;
  }
}

// In pieces of a cell: software that draws lines drops long ones that pass behind the camera.
function grid() {
  const points = [], half = (CELL * CELLS) / 2;
  for (let a = -half; a <= half; a += CELL) {
    for (let b = -half; b < half; b += CELL) points.push(a, 0, b, a, 0, b + CELL, b, 0, a, b + CELL, 0, a);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: "#8a939b", transparent: true, opacity: 0.5 }));
}

// The commanded attitude: axis, span and fin.
function ghost() {
  const points = [turned(44, 0, 0), turned(-28, 0, 0), turned(-15, 13, 0), turned(-15, -13, 0), turned(-24, 0, 0), turned(-24, 0, -13)];
  const geometry = new THREE.BufferGeometry().setFromPoints(points);
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: "#d0488f" }));
}
