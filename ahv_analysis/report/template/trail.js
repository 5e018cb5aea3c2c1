"use strict";
// A flight's trail, and the ribbon between it and the altitude to follow.

class Trail {
  constructor(count, paint) {
    this.count = count;
    this.line = polyline(count, new THREE.LineBasicMaterial({ color: paint }));
    this.reference = polyline(count, new THREE.LineBasicMaterial({ color: "#808890" }));
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * count), 3).setUsage(THREE.DynamicDrawUsage));
    const faces = [];
    for (let i = 0; i + 1 < count; i++) faces.push(2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2);
    geometry.setIndex(faces);
    const veil = new THREE.MeshBasicMaterial({ color: paint, transparent: true, opacity: 0.16, side: THREE.DoubleSide, depthWrite: false });
    this.ribbon = new THREE.Mesh(geometry, veil);
    this.ribbon.frustumCulled = false;
    this.group = new THREE.Group();
    this.group.add(this.line, this.reference, this.ribbon);
  }

  // Points [x, y, z] and, where there is an altitude to follow, the height y of it below or above.
  draw(points, heights) {
    const line = this.line.geometry.attributes.position, reference = this.reference.geometry.attributes.position;
    const ribbon = this.ribbon.geometry.attributes.position;
    points.forEach(([x, y, z], i) => {
      line.setXYZ(i, x, y, z);
      if (!heights) return;
      reference.setXYZ(i, x, heights[i], z);
      ribbon.setXYZ(2 * i, x, y, z);
      ribbon.setXYZ(2 * i + 1, x, heights[i], z);
    });
    for (const attribute of [line, reference, ribbon]) attribute.needsUpdate = true;
    this.line.geometry.setDrawRange(0, points.length);
    this.reference.visible = this.ribbon.visible = Boolean(heights);
    this.reference.geometry.setDrawRange(0, points.length);
    this.ribbon.geometry.setDrawRange(0, Math.max(0, 6 * (points.length - 1)));
  }
}
