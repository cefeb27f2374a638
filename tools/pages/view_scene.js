// SPDX-License-Identifier: BSD-3-Clause
// The stage: bounds of what moves, planes, light, camera.
"use strict";

// Where what moves in a system gets to, looked at in some frames, and its fixed shapes that are not much larger.
function boundsOf({ motion, bodies, shapes, links, fixed: still, node_count }) {
  const box = new THREE.Box3(), point = new THREE.Vector3(), turn = new THREE.Quaternion();
  const fixed = [];
  const add = (centre, radius) => box.expandByPoint(centre.clone().addScalar(radius)).expandByPoint(centre.clone().addScalar(-radius));
  const inBody = (body, local) => {
    motion.pose(body, point, turn);
    return new THREE.Vector3(...local).applyQuaternion(turn).add(point);
  };
  const frames = Math.min(40, motion.t.length);
  for (let k = 0; k < frames; ++k) {
    motion.moveTo(motion.t[Math.round((k * (motion.t.length - 1)) / Math.max(1, frames - 1))]);
    bodies.forEach((_, body) => still[body] || add(inBody(body, [0, 0, 0]), 0));
    for (const shape of shapes) {
      if (shape.kind === "plane") continue;
      const reach = [inBody(shape.body, shape.position), reachOf[shape.kind](shape.size, shape)];
      if (shape.body >= 0 && !still[shape.body]) add(...reach);
      else if (k === 0) fixed.push(reach);
    }
    for (const link of links) for (const end of [0, 1]) add(inBody(link.bodies[end], link.points[end]), 0);
    for (let node = 0; node < node_count; ++node) box.expandByPoint(motion.node(node, point));
  }
  motion.moveTo(motion.t[0]);
  const radius = box.isEmpty() ? Infinity : radiusOf(box);
  for (const [centre, reach] of fixed) if (reach < 3 * radius) add(centre, reach);
  if (box.isEmpty()) add(new THREE.Vector3(), 1);
  return box.expandByScalar(0.05 * radiusOf(box));
}

function radiusOf(box) {
  return Math.max(1e-9, box.getBoundingSphere(new THREE.Sphere()).radius);
}

// A round length, a third of the size at most.
function gridSpacing(size) {
  const power = 10 ** Math.floor(Math.log10(size / 3));
  return power * [5, 2, 1].find((step) => 3 * step * power <= size);
}

// How far each system is moved. Systems that would be drawn over one another stand in a row, whole spacings of the grid apart.
function offsetsOf(boxes, up) {
  const zero = boxes.map(() => new THREE.Vector3());
  if (!boxes.some((box, k) => boxes.slice(k + 1).some((other) => other.intersectsBox(box)))) return zero;
  const all = boxes.reduce((whole, box) => whole.union(box), new THREE.Box3()), { front, right, flat } = axesOf(all, up);
  const axis = flat === front ? right : front, spacing = gridSpacing(radiusOf(all));
  const apart = Math.ceil((1.1 * all.getSize(new THREE.Vector3()).getComponent(axis)) / spacing) * spacing;
  return zero.map((offset, k) => offset.setComponent(axis, k * apart));
}

// The axis that points most against gravity; z where there is none.
function upwards() {
  const gravity = run.systems[0].gravity;
  const strongest = gravity.reduce((best, g, k) => (Math.abs(g) > Math.abs(gravity[best]) ? k : best), 2);
  const up = new THREE.Vector3();
  return up.setComponent(strongest, gravity[strongest] > 0 ? -1 : 1);
}

// The part of a convex polygon on the side of the plane that its normal points to (Sutherland and Hodgman).
function clipped(polygon, { point, normal }, tolerance) {
  const heights = polygon.map((vertex) => normal.dot(vertex) - normal.dot(point));
  return polygon.flatMap((vertex, k) => {
    const next = (k + 1) % polygon.length, h = heights[k], g = heights[next];
    const inside = h >= -tolerance, kept = inside ? [vertex] : [];
    if (inside === g >= -tolerance) return kept;
    return [...kept, vertex.clone().lerp(polygon[next], Math.min(1, Math.max(0, h / (h - g))))];
  });
}

// Planes are endless. What is drawn is the part that the system's other planes leave, around the motion; walls are glass.
function addPlanes(system, parent, box, size, up) {
  const centre = box.getCenter(new THREE.Vector3()), position = new THREE.Vector3(), turn = new THREE.Quaternion();
  const planes = system.shapes.filter((shape) => shape.kind === "plane").map((shape) => {
    system.motion.pose(shape.body, position, turn);
    const [w, x, y, z] = shape.orientation;
    const whole = turn.clone().multiply(new THREE.Quaternion(x, y, z, w));
    const axes = [0, 1, 2].map((k) => new THREE.Vector3().setComponent(k, 1).applyQuaternion(whole));
    return { point: new THREE.Vector3(...shape.position).applyQuaternion(turn).add(position), axes, normal: axes[2] };
  });
  const walls = [];
  if (planes.length > 1)
    for (const axis of [0, 1, 2]) for (const sign of [-1, 1]) {
      const normal = new THREE.Vector3().setComponent(axis, -sign);
      walls.push({ point: (sign > 0 ? box.max : box.min).clone().addScaledVector(normal, -0.12 * size), normal });
    }
  for (const plane of planes) {
    const [across, along, normal] = plane.axes, wide = 2.2 * size, tolerance = 1e-6 * size;
    const middle = centre.clone().addScaledVector(normal, normal.dot(plane.point) - normal.dot(centre));
    let polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) =>
      middle.clone().addScaledVector(across, a * wide).addScaledVector(along, b * wide));
    for (const other of [...planes, ...walls]) if (other !== plane) polygon = clipped(polygon, other, tolerance);
    if (polygon.length < 3) continue;
    const floor = normal.dot(up) > 0.7;
    const geometry = new THREE.BufferGeometry().setFromPoints(polygon);
    geometry.setIndex(polygon.slice(2).flatMap((_, k) => [0, k + 1, k + 2]));
    geometry.computeVertexNormals();
    const face = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({
      color: "#eceef0", roughness: 0.9, transparent: !floor, opacity: floor ? 1 : 0.3, depthWrite: floor,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
    face.receiveShadow = true;
    const lines = floor ? gridLines(polygon, plane, middle, size, tolerance) : [];
    polygon.forEach((vertex, k) => lines.push(vertex, polygon[(k + 1) % polygon.length]));
    parent.add(face, new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(lines),
      new THREE.LineBasicMaterial({ color: "#c9cfd5" })));
  }
}

// Lines of a grid with a round spacing, cut to the polygon.
function gridLines(polygon, plane, middle, size, tolerance) {
  const spacing = gridSpacing(size), lines = [];
  for (const [direction, normal] of [plane.axes, [plane.axes[1], plane.axes[0]]]) {
    const heights = polygon.map((vertex) => normal.dot(vertex) - normal.dot(plane.point));
    for (let k = Math.ceil(Math.min(...heights) / spacing); k * spacing < Math.max(...heights); ++k) {
      const cut = { point: plane.point.clone().addScaledVector(normal, k * spacing), normal };
      const ends = clipped(polygon, cut, 0).filter((vertex) => Math.abs(normal.dot(vertex) - normal.dot(cut.point)) < tolerance);
      if (ends.length === 2) lines.push(...ends);
    }
  }
  return lines;
}

// The axes of the view; flat is the one along which next to nothing happens, or -1. The first of the two level axes goes to
// the right: the viewer stands at -y where z is up, at +z where y is up.
function axesOf(box, up) {
  const extent = box.getSize(new THREE.Vector3()).toArray(), smallest = Math.min(...extent);
  const vertical = up.toArray().findIndex((component) => component !== 0), front = vertical === 1 ? 2 : (vertical + 2) % 3;
  return { vertical, front, right: 3 - vertical - front, flat: smallest < 0.1 * Math.max(...extent) ? extent.indexOf(smallest) : -1 };
}

// From where motion in a plane is seen at its widest, and any other from a corner.
function viewDirection(box, up) {
  const { vertical, front, right, flat } = axesOf(box, up), towards = vertical === 1 ? 1 : -1;
  const direction = (along, sideways, above) =>
    new THREE.Vector3().setComponent(front, along * towards).setComponent(right, sideways).addScaledVector(up, above).normalize();
  if (flat === vertical) return direction(0.4, 0, 1);
  if (flat === front) return direction(1, 0.25, 0.25);
  if (flat === right) return direction(0.25, 1, 0.25);
  return direction(1, 0.6, 0.55);
}

class Stage {
  // Throws where there is no WebGL.
  constructor(place) {
    this.place = place;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    place.append(this.renderer.domElement);
    this.up = upwards();
    const boxes = run.systems.map(boundsOf), offsets = offsetsOf(boxes, this.up), own = Math.max(...boxes.map(radiusOf));
    this.box = boxes.reduce((whole, box, k) => whole.union(box.clone().translate(offsets[k])), new THREE.Box3());
    this.size = radiusOf(this.box);
    this.centre = this.box.getCenter(new THREE.Vector3());
    this.scene = new THREE.Scene();
    this.views = run.systems.map((system, k) => {
      const view = new SystemView(system, own);
      addPlanes(system, view.parts.fixed, boxes[k], own, this.up);
      view.group.position.copy(offsets[k]);
      this.scene.add(view.group);
      return view;
    });
    this.addLight();
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.01 * this.size, 60 * this.size);
    this.camera.up.copy(this.up);
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.requestFrame());
    this.resize();
    this.fit();
    new ResizeObserver(() => this.resize()).observe(place);
  }

  addLight() {
    const sky = new THREE.HemisphereLight("#ffffff", "#b9c0c8", 1.8), sun = new THREE.DirectionalLight("#ffffff", 2.1);
    sky.position.copy(this.up);
    const side = viewDirection(this.box, this.up);
    sun.position.copy(this.centre).addScaledVector(this.up, 2.6 * this.size).addScaledVector(side, 1.2 * this.size);
    sun.position.add(new THREE.Vector3().crossVectors(side, this.up).multiplyScalar(1.1 * this.size));
    sun.target.position.copy(this.centre);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    const wide = 1.3 * this.size;
    Object.assign(sun.shadow.camera, { left: -wide, right: wide, bottom: -wide, top: wide, near: 0.2 * this.size, far: 7 * this.size });
    sun.shadow.normalBias = 0.012 * this.size;
    this.scene.add(sky, sun, sun.target);
  }

  // As near as all corners of the bounds allow.
  fit() {
    const high = Math.tan((this.camera.fov * Math.PI) / 360), wide = high * this.camera.aspect;
    const towards = viewDirection(this.box, this.up);
    const right = new THREE.Vector3().crossVectors(this.up, towards).normalize(), above = new THREE.Vector3().crossVectors(towards, right);
    let distance = 0;
    for (let k = 0; k < 8; ++k) {
      const corner = new THREE.Vector3(...["x", "y", "z"].map((axis, i) => this.box[k & (1 << i) ? "max" : "min"][axis])).sub(this.centre);
      const apart = Math.max(Math.abs(corner.dot(above)) / high, Math.abs(corner.dot(right)) / wide);
      distance = Math.max(distance, corner.dot(towards) + 1.15 * Math.max(apart, 0.1 * this.size));
    }
    this.camera.position.copy(this.centre).addScaledVector(towards, distance);
    this.controls.target.copy(this.centre);
    this.controls.update();
    this.requestFrame();
  }

  resize() {
    const { clientWidth, clientHeight } = this.place;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(clientWidth, clientHeight);
    this.camera.aspect = clientWidth / Math.max(1, clientHeight);
    this.camera.updateProjectionMatrix();
    this.draw(); // at once, for the canvas is empty now
  }

  // Draws once before the next picture of the screen, however often it is called.
  requestFrame() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  draw() {
    for (const view of this.views) if (view.group.visible) view.update();
    this.renderer.render(this.scene, this.camera);
    document.documentElement.dataset.framesDrawn = this.renderer.info.render.frame;
  }
}
