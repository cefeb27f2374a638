// SPDX-License-Identifier: BSD-3-Clause
// What the page shows of a system in space, and how it follows the motion. Lengths are in m; `size` is the radius of all that
// moves, which markers without a size of their own are drawn by.
"use strict";

const palette = ["#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#76b7b2", "#edc948", "#b07aa1", "#9c755f"];
const colours = { fixed: "#aab1b8", joint: "#1d2329", rod: "#7a8590", spring: "#0f8a6d", cable: "#b0651f", contact: "#d6204e" };
const alongZ = new THREE.Vector3(0, 0, 1);

// Bodies of several systems have their system's colour, lighter and darker by turns; those of one have all of them.
function bodyColour(system, body) {
  const place = run.systems.indexOf(system);
  if (run.systems.length === 1) return new THREE.Color(palette[body % palette.length]);
  return new THREE.Color(palette[place % palette.length]).offsetHSL(0, 0, 0.05 * (body % 3));
}

const reachOfMesh = (_, shape) => shape.vertices.reduce((reach, vertex) => Math.max(reach, Math.hypot(...vertex)), 0);

const reachOf = {
  sphere: ([r]) => r,
  box: (half) => Math.hypot(...half),
  capsule: ([r, h]) => r + h,
  cylinder: ([r, h]) => Math.hypot(r, h),
  convex: reachOfMesh,
  terrain: reachOfMesh,
  height_field: reachOfMesh,
};

// Round shapes have sectors of two tones, so that their rotation is seen.
function withSectors(geometry) {
  const faces = geometry.toNonIndexed();
  const { position } = faces.attributes, tones = new Float32Array(3 * position.count);
  for (let i = 0; i < position.count; i += 3) {
    const [x, y, z] = ["X", "Y", "Z"].map((axis) => [0, 1, 2].reduce((sum, k) => sum + position[`get${axis}`](i + k), 0));
    const sector = Math.floor((2 * Math.atan2(y, x)) / Math.PI) + (z > 0 ? 1 : 0);
    tones.fill(sector % 2 === 0 ? 1 : 0.8, 3 * i, 3 * i + 9);
  }
  faces.setAttribute("color", new THREE.BufferAttribute(tones, 3));
  return faces;
}

function meshGeometry(shape) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(shape.vertices.flat()), 3));
  geometry.setIndex(shape.triangles.flat());
  const faces = geometry.toNonIndexed();
  faces.computeVertexNormals();
  return faces;
}

// A shape as a scaled copy of a geometry that shapes with the same key share.
function sharedGeometry(shape, place) {
  const [a, b] = shape.size, upright = Math.PI / 2;
  switch (shape.kind) {
    case "sphere": return { key: "sphere", scale: [a, a, a], make: () => withSectors(new THREE.SphereGeometry(1, 32, 20).rotateX(upright)) };
    case "box": return { key: "box", scale: shape.size, make: () => new THREE.BoxGeometry(2, 2, 2) };
    case "cylinder": return { key: "cylinder", scale: [a, a, b], make: () => withSectors(new THREE.CylinderGeometry(1, 1, 2, 32).rotateX(upright)) };
    case "capsule": return { key: `capsule ${(b / a).toPrecision(6)}`, scale: [a, a, a],
                             make: () => withSectors(new THREE.CapsuleGeometry(1, (2 * b) / a, 8, 32).rotateX(upright)) };
    default: return { key: `mesh ${place}`, scale: [1, 1, 1], make: () => meshGeometry(shape) };
  }
}

// Copies of one geometry; each has a colour and place(matrix), which says where it is now.
class Copies {
  constructor(parent, geometry, items, options = {}) {
    const material = new THREE.MeshStandardMaterial({ roughness: 0.6, vertexColors: "color" in geometry.attributes, ...options });
    this.mesh = new THREE.InstancedMesh(geometry, material, items.length);
    this.mesh.frustumCulled = false; // its bounds would be those of the first frame
    this.mesh.castShadow = this.mesh.receiveShadow = true;
    this.items = items;
    items.forEach((item, k) => this.mesh.setColorAt(k, new THREE.Color(item.colour)));
    this.matrix = new THREE.Matrix4();
    parent.add(this.mesh);
  }
  // Places and shows the first `count` of them.
  update(count = this.items.length) {
    this.mesh.count = count;
    for (let k = 0; k < count; ++k) {
      this.items[k].place(this.matrix);
      this.mesh.setMatrixAt(k, this.matrix);
    }
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}

// Spheres where at(vector) says.
function markers(parent, items) {
  const position = new THREE.Vector3();
  return new Copies(parent, new THREE.SphereGeometry(1, 16, 12), items.map(({ at, radius, colour }) => ({
    colour,
    place: (matrix) => matrix.makeScale(radius, radius, radius).setPosition(at(position)),
  })));
}

// Geometry along z from 0 to 1 that is stretched from one point to another.
function stretched(parent, geometry, items) {
  const from = new THREE.Vector3(), to = new THREE.Vector3(), scale = new THREE.Vector3(), turn = new THREE.Quaternion();
  return new Copies(parent, geometry, items.map((item) => ({
    colour: item.colour,
    place: (matrix) => {
      item.from(from);
      to.copy(item.to(to)).sub(from);
      const length = Math.max(to.length(), 1e-12);
      turn.setFromUnitVectors(alongZ, to.divideScalar(length));
      matrix.compose(from, turn, scale.set(item.radius, item.radius, length));
    },
  })));
}

const rod = () => new THREE.CylinderGeometry(1, 1, 1, 12).rotateX(Math.PI / 2).translate(0, 0, 0.5);

// A coil around z from 0 to 1, whose wire looks round at the length `length` and the radius `radius`.
function coil(length, radius) {
  class Helix extends THREE.Curve {
    getPoint(u, target = new THREE.Vector3()) {
      const turned = 16 * Math.PI * u, wide = Math.min(1, 12 * u, 12 * (1 - u)); // it begins and ends on the axis
      return target.set(radius * wide * Math.cos(turned), radius * wide * Math.sin(turned), length * u);
    }
  }
  return new THREE.TubeGeometry(new Helix(), 240, 0.14 * radius, 6).scale(1 / radius, 1 / radius, 1 / length);
}

class SystemView {
  constructor(system, size) {
    this.system = system;
    this.motion = system.motion;
    this.group = new THREE.Group();
    this.parts = { fixed: new THREE.Group(), joints: new THREE.Group(), contacts: new THREE.Group() };
    this.group.add(...Object.values(this.parts));
    this.size = size;
    this.copies = [];
    this.bodies = system.bodies.map(() => new THREE.Matrix4());
    this.world = new THREE.Matrix4();
    this.addShapes();
    this.addShapelessBodies();
    this.addLinks();
    if (system.node_count > 0) this.addNodes();
    if (this.motion.mostContacts > 0) this.addContacts();
  }

  isFixed(body) {
    return body < 0 || this.system.fixed[body] !== 0;
  }
  matrixOf(body) {
    return body < 0 ? this.world : this.bodies[body];
  }
  // Where a link holds its first or second body.
  anchor(link, end) {
    const local = new THREE.Vector3(...link.points[end]);
    return (vector) => vector.copy(local).applyMatrix4(this.matrixOf(link.bodies[end]));
  }
  centre(body) {
    return (vector) => vector.setFromMatrixPosition(this.matrixOf(body));
  }

  addShapes() {
    const sorted = new Map();
    this.system.shapes.forEach((shape, k) => {
      if (shape.kind === "plane") return;
      const { key, scale, make } = sharedGeometry(shape, k), fixed = this.isFixed(shape.body);
      const [w, x, y, z] = shape.orientation;
      const local = new THREE.Matrix4().compose(
        new THREE.Vector3(...shape.position), new THREE.Quaternion(x, y, z, w), new THREE.Vector3(...scale));
      const full = `${key} ${fixed}`;
      if (!sorted.has(full)) sorted.set(full, { make, fixed, items: [] });
      sorted.get(full).items.push({
        colour: fixed ? colours.fixed : bodyColour(this.system, shape.body),
        place: (matrix) => matrix.multiplyMatrices(this.matrixOf(shape.body), local),
      });
    });
    for (const { make, fixed, items } of sorted.values())
      this.copies.push(new Copies(fixed ? this.parts.fixed : this.group, make(), items));
  }

  // A body without a shape is a ball at its mass centre, with its axes, and rods to where it is held.
  addShapelessBodies() {
    const shaped = new Set(this.system.shapes.map((shape) => shape.body));
    const balls = [], rods = [];
    this.system.bodies.forEach((_, body) => {
      if (shaped.has(body) || this.isFixed(body)) return;
      const arms = this.system.links.flatMap((link) => [0, 1].filter((end) => link.bodies[end] === body).map((end) => ({
        at: this.anchor(link, end), length: Math.hypot(...link.points[end]) })));
      const longest = Math.max(0, ...arms.map((arm) => arm.length));
      const radius = longest > 0 ? Math.min(0.045 * this.size, 0.3 * longest) : 0.045 * this.size;
      const colour = bodyColour(this.system, body), centre = this.centre(body);
      balls.push({ at: centre, radius, colour });
      for (const arm of arms.filter(({ length }) => length > 1e-9 * this.size))
        rods.push({ from: centre, to: arm.at, radius: 0.35 * radius, colour });
      [[1, 0, 0], [0, 1, 0], [0, 0, 1]].forEach((axis, k) => {
        const tip = new THREE.Vector3(...axis).multiplyScalar(1.9 * radius);
        rods.push({ from: centre, to: (vector) => vector.copy(tip).applyMatrix4(this.matrixOf(body)),
                    radius: 0.13 * radius, colour: ["#c0392b", "#2e8b57", "#2f6fb3"][k] });
      });
    });
    if (balls.length > 0) this.copies.push(markers(this.group, balls), stretched(this.group, rod(), rods));
  }

  addLinks() {
    const radius = 0.018 * this.size, points = [], rods = [];
    for (const link of this.system.links) {
      const from = this.anchor(link, 0), to = this.anchor(link, 1);
      points.push({ at: from, radius, colour: colours.joint });
      if (link.kind === "distance") rods.push({ from, to, radius: 0.35 * radius, colour: colours.rod });
      if (link.kind === "distance" || link.kind === "spring") points.push({ at: to, radius, colour: colours.joint });
      if (link.kind !== "spring") continue;
      this.placeBodies();
      const length = Math.max(1e-6 * this.size, from(new THREE.Vector3()).distanceTo(to(new THREE.Vector3())));
      const wide = Math.min(1.6 * radius, 0.3 * length);
      this.copies.push(stretched(this.parts.joints, coil(length, wide), [{ from, to, radius: wide, colour: colours.spring }]));
    }
    if (points.length > 0) this.copies.push(markers(this.parts.joints, points));
    if (rods.length > 0) this.copies.push(stretched(this.parts.joints, rod(), rods));
  }

  addNodes() {
    const { system, motion } = this;
    const [surface, cables, loose] = [system.surface, system.cables, system.loose].map((text) => numbers(text, Int32Array));
    const node = (index) => (vector) => motion.node(index, vector);
    const radius = 0.02 * this.size;
    if (loose.length > 0)
      this.copies.push(markers(this.group, [...loose].map((k) => ({ at: node(k), radius, colour: palette[0] }))));
    const rods = [];
    for (let k = 0; k < cables.length; k += 2)
      rods.push({ from: node(cables[k]), to: node(cables[k + 1]), radius: 0.3 * radius, colour: colours.cable });
    if (rods.length > 0) this.copies.push(stretched(this.group, rod(), rods));
    if (surface.length > 0) this.addSurface(surface);
  }

  // The skin of the elastic blocks, with the edges of its triangles.
  addSurface(triangles) {
    this.skin = new THREE.BufferAttribute(new Float32Array(3 * this.system.node_count), 3);
    const faces = new THREE.BufferGeometry(), edges = new THREE.BufferGeometry(), pairs = new Map();
    for (let k = 0; k < triangles.length; ++k) {
      const a = triangles[k], b = triangles[k % 3 === 2 ? k - 2 : k + 1];
      pairs.set(Math.min(a, b) * this.system.node_count + Math.max(a, b), [a, b]);
    }
    for (const geometry of [faces, edges]) geometry.setAttribute("position", this.skin);
    faces.setIndex([...triangles]);
    edges.setIndex([...pairs.values()].flat());
    const colour = bodyColour(this.system, this.system.bodies.length);
    const skin = new THREE.Mesh(faces, new THREE.MeshStandardMaterial({
      color: colour, roughness: 0.7, flatShading: true, side: THREE.DoubleSide, shadowSide: THREE.BackSide,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
    skin.castShadow = skin.receiveShadow = true;
    const lines = new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ color: colour.clone().multiplyScalar(0.5) }));
    skin.frustumCulled = lines.frustumCulled = false;
    this.group.add(skin, lines);
  }

  addContacts() {
    const radius = 0.012 * this.size;
    const items = Array.from({ length: this.motion.mostContacts }, (_, k) => ({
      colour: colours.contact,
      place: (matrix) => matrix.makeScale(radius, radius, radius).setPosition(...this.points.subarray(3 * k, 3 * k + 3)),
    }));
    this.dots = new Copies(this.parts.contacts, new THREE.SphereGeometry(1, 10, 8), items, { depthTest: false, transparent: true });
    this.dots.mesh.renderOrder = 1; // seen through the bodies that touch there
    this.dots.mesh.castShadow = false;
  }

  placeBodies() {
    const position = new THREE.Vector3(), turn = new THREE.Quaternion(), one = new THREE.Vector3(1, 1, 1);
    this.bodies.forEach((matrix, body) => {
      this.motion.pose(body, position, turn);
      matrix.compose(position, turn, one);
    });
  }

  update() {
    this.placeBodies();
    for (const copies of this.copies) copies.update();
    if (this.skin) {
      this.motion.allNodes(this.skin.array);
      this.skin.needsUpdate = true;
    }
    if (this.dots) {
      this.points = this.motion.contactPoints();
      this.dots.update(this.points.length / 3);
    }
  }
}
