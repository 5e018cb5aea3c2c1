"use strict";
// The view of the whole path: heights and sideways distances stretched, the vehicle enlarged.

const BREADTH = 2; // of the drawing, for the longest distance
const HEIGHT_DRAWN = 0.6;
const LEAST = 100; // [m] that the drawing's height or depth stands for

class PathView {
  constructor(motions, paints, parts) {
    this.motions = motions;
    this.camera = new Orbit({ azimuth: 1.2, elevation: 0.35, distance: 2.3, nearest: 0.3, farthest: 12 });
    this.group = new THREE.Group();
    const all = (...names) => motions.map((motion) => motion.range(...names));
    const least = (ranges) => Math.min(...ranges.map(([low]) => low));
    const most = (ranges) => Math.max(...ranges.map(([, high]) => high));
    const span = (...names) => [least(all(...names)), most(all(...names))];
    [this.north, this.east, this.height] = [span("x"), span("y"), span("h", "reference")];
    const width = ([low, high], floor) => Math.max(high - low, floor);
    const longest = Math.max(width(this.north, LEAST), width(this.east, LEAST));
    this.level = BREADTH / longest;
    this.up = HEIGHT_DRAWN / width(this.height, LEAST);
    // what is short beside the other is stretched, to a quarter of it at most
    const side = (range) => Math.max(this.level, Math.min(0.25 * BREADTH / width(range, LEAST), 1e9));
    [this.along, this.across] = [side(this.north), side(this.east)];
    this.floor = new THREE.GridHelper(BREADTH * 1.2, 12, "#8a939b", "#8a939b");
    this.floor.material.transparent = true;
    this.floor.material.opacity = 0.35;
    this.floor.scale.z = this.across * (this.east[1] - this.east[0]) > 0.6 * BREADTH ? 1 : 0.4;
    this.floor.position.y = -HEIGHT_DRAWN / 2;
    this.group.add(this.floor);
    this.vehicles = motions.map((motion, index) => {
      const vehicle = new Vehicle(parts, motions.length > 1 ? paints[index] : "#c9d1d9");
      vehicle.group.scale.setScalar(0.005);
      const step = Math.ceil(motion.time.length / 1500);
      const points = [], heights = [];
      for (let i = 0; i < motion.time.length; i += step) {
        const { x, y, h, reference } = motion.channels;
        points.push(this.place(x[i], y[i], h[i]));
        heights.push(reference ? this.place(0, 0, reference[i])[1] : -HEIGHT_DRAWN / 2);
      }
      const whole = new Trail(points.length, "#8a939b");
      whole.draw(points, null);
      const flown = new Trail(points.length, paints[index]);
      flown.draw(points, heights);
      this.group.add(whole.group, flown.group, vehicle.group);
      return { vehicle, flown, step };
    });
  }

  place(x, y, h) {
    const centred = (value, [low, high], scale) => (value - (low + high) / 2) * scale;
    return [centred(x, this.north, this.along), centred(h, this.height, this.up), centred(y, this.east, this.across)];
  }

  show(time) {
    this.motions.forEach((motion, index) => {
      const now = motion.at(time), { vehicle, flown, step } = this.vehicles[index];
      vehicle.show(now);
      vehicle.group.position.set(...this.place(now.x, now.y, now.h));
      const count = Math.floor(motion.index(time) / step) + 1;
      flown.line.geometry.setDrawRange(0, count);
      flown.reference.visible = motion.followsAltitude;
      flown.ribbon.geometry.setDrawRange(0, 6 * (count - 1));
    });
  }

  labels() {
    const { x, y } = this.motions[0].channels;
    const start = this.place(x[0], y[0], 0), end = this.place(x.at(-1), y.at(-1), 0);
    const kilometres = (value) => `${(value / 1000).toFixed(2)} km`;
    return [
      [kilometres(this.height[1]), new THREE.Vector3(start[0] - 0.12, HEIGHT_DRAWN / 2, start[2])],
      [kilometres(this.height[0]), new THREE.Vector3(start[0] - 0.12, -HEIGHT_DRAWN / 2, start[2])],
      [`${((x.at(-1) - x[0]) / 1000).toFixed(0)} km north`, new THREE.Vector3(end[0], -HEIGHT_DRAWN / 2, end[2])],
    ];
  }

  note() {
    const times = (scale) => String(Number((scale / this.level).toPrecision(2)));
    const reference = this.motions[0].followsAltitude ? "The grey line is the altitude to follow." : "The ribbon goes down to the lowest altitude.";
    return `Heights ${times(this.up)}, east ${times(this.across)} times the scale of north; the vehicle is enlarged, its attitude true. ${reference}`;
  }
}
