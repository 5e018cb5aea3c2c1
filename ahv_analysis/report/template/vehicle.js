"use strict";
// The winged cone in three dimensions. Axes of three.js: x north or forward, y up, z east or right.

const ANGLES_DRAWN = 5; // times as large as they are, up to 6 deg; beyond that less and less so
const ARROW = 42; // [m] of the velocity, and of the circle on which angles are drawn
const WEIGHT = 22; // [m] of lift that carries the vehicle's weight

// Body or Earth axes (forward, right, down) in those of three.js.
const turned = (x, y, z) => new THREE.Vector3(x, -z, y);

function widened(angle) {
  const most = (6 * Math.PI) / 180, size = Math.abs(angle);
  if (size <= most) return angle * ANGLES_DRAWN;
  const rest = (Math.PI - ANGLES_DRAWN * most) / (Math.PI - most);
  return Math.sign(angle) * (ANGLES_DRAWN * most + (size - most) * rest);
}

function triangles(corners) {
  const geometry = new THREE.BufferGeometry();
  const points = new Float32Array(corners.length);
  for (let i = 0; i < corners.length; i += 3) turned(...corners.slice(i, i + 3)).toArray(points, i);
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  geometry.computeVertexNormals();
  return geometry;
}

class Vehicle {
  constructor(parts, paint) {
    this.group = new THREE.Group(); // turns with the vehicle
    this.skin = new THREE.MeshLambertMaterial({ color: paint, flatShading: true, side: THREE.DoubleSide });
    this.hinged = new THREE.MeshLambertMaterial({ color: "#f2a33a", flatShading: true, side: THREE.DoubleSide });
    this.group.add(new THREE.Mesh(triangles(parts.body), this.skin));
    this.surfaces = parts.surfaces.map((part) => {
      const mesh = new THREE.Mesh(triangles(part.corners), this.hinged);
      mesh.position.copy(turned(...part.hinge));
      this.group.add(mesh);
      return { name: part.name, mesh, axis: turned(...part.axis) };
    });
    const fire = new THREE.MeshBasicMaterial({ color: "#ff7a1a", transparent: true, opacity: 0.75, depthWrite: false });
    const core = new THREE.MeshBasicMaterial({ color: "#ffe9a8", transparent: true, opacity: 0.9, depthWrite: false });
    this.flame = new THREE.Group();
    for (const [radius, length, material] of [[1.9, 1, fire], [1.0, 0.6, core]]) {
      const cone = new THREE.ConeGeometry(radius, length, 16, 1, true);
      cone.rotateZ(Math.PI / 2); // its tip aft
      cone.translate(-length / 2, 0, 0);
      this.flame.add(new THREE.Mesh(cone, material));
    }
    const points = parts.body.filter((_, index) => index % 3 === 0);
    this.flame.position.x = Math.min(...points);
    this.group.add(this.flame);
  }

  show(now) {
    this.group.quaternion.copy(attitude(now.phi, now.theta, now.psi));
    for (const { name, mesh, axis } of this.surfaces) mesh.quaternion.setFromAxisAngle(axis, now[name]);
    this.flame.scale.set(4 + 50 * now.throttle, 0.6 + now.throttle, 0.6 + now.throttle);
  }
}

const attitude = (phi, theta, psi) =>
  new THREE.Quaternion().setFromEuler(new THREE.Euler(phi, -psi, theta, "YZX"));

// Where the vehicle flies to, in its own axes.
function direction(alpha, beta) {
  return turned(Math.cos(alpha) * Math.cos(beta), Math.sin(beta), Math.sin(alpha) * Math.cos(beta));
}

// Velocity, lift, and the angles to the air, which turn with the vehicle.
class AirVectors {
  constructor() {
    this.group = new THREE.Group();
    this.velocity = new THREE.ArrowHelper(new THREE.Vector3(1, 0, 0), new THREE.Vector3(), ARROW, "#2a78d0", 5, 2.5);
    this.lift = new THREE.ArrowHelper(new THREE.Vector3(0, 1, 0), new THREE.Vector3(), WEIGHT, "#1f9d73", 4, 2.2);
    this.alpha = arc("#d9542b");
    this.beta = arc("#9256c8");
    this.group.add(this.velocity, this.lift, this.alpha, this.beta);
    this.tips = { V: new THREE.Vector3(), L: new THREE.Vector3(), α: new THREE.Vector3(), β: new THREE.Vector3() };
  }

  show(now) {
    const [alpha, beta] = [widened(now.alpha), widened(now.beta)];
    const radius = ARROW * 0.94;
    this.slips = Math.abs(now.beta) > 0.002; // enough to be seen
    this.beta.visible = this.slips;
    this.velocity.setDirection(direction(alpha, beta));
    this.lift.setDirection(turned(Math.sin(now.alpha), 0, -Math.cos(now.alpha)).multiplyScalar(Math.sign(now.lift) || 1));
    const length = Math.min(Math.max(Math.abs(now.lift) * WEIGHT, 1), 3 * WEIGHT);
    this.lift.setLength(length, Math.min(4, length / 2), Math.min(2.2, length / 3));
    bend(this.alpha, (share) => direction(alpha * share, 0).multiplyScalar(radius));
    bend(this.beta, (share) => direction(alpha, beta * share).multiplyScalar(radius));
    this.tips.V.copy(direction(alpha, beta)).multiplyScalar(ARROW + 3);
    this.tips.L.copy(this.lift.position).add(new THREE.Vector3(0, 1, 0).applyQuaternion(this.lift.quaternion).multiplyScalar(length + 3));
    this.tips.α.copy(direction(alpha / 2, 0)).multiplyScalar(radius + 3);
    this.tips.β.copy(direction(alpha, beta / 2)).multiplyScalar(radius + 3);
  }
}

const ARC = 33; // points of an arc

function arc(paint) {
  return polyline(ARC, new THREE.LineBasicMaterial({ color: paint, depthTest: false }));
}

function polyline(count, material) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * count), 3).setUsage(THREE.DynamicDrawUsage));
  const line = new THREE.Line(geometry, material);
  line.frustumCulled = false; // it moves
  return line;
}

function bend(line, place) {
  const points = line.geometry.attributes.position;
  for (let i = 0; i < ARC; i++) points.setXYZ(i, ...place(i / (ARC - 1)).toArray());
  points.needsUpdate = true;
}
