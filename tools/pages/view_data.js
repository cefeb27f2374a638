// SPDX-License-Identifier: BSD-3-Clause
// The run as it stands in the page, and where everything is at a time.
"use strict";

function numbers(text, Kind) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) bytes[i] = raw.charCodeAt(i);
  return new Kind(bytes.buffer);
}

// A system's motion. Between frames, positions are interpolated linearly and orientations along the shorter arc.
class Motion {
  constructor(system) {
    this.t = numbers(system.t, Float64Array);
    this.poses = numbers(system.poses, Float32Array);
    this.nodes = numbers(system.nodes, Float32Array);
    this.contacts = numbers(system.contacts, Float32Array);
    this.contactEnd = numbers(system.contact_end, Int32Array);
    this.nodeCount = system.node_count;
    this.movingCount = 0;
    this.place = system.fixed.map((fixed) => (fixed ? -1 : this.movingCount++)); // of a body among the moving ones
    this.fixedPoses = system.fixed_poses;
    this.next = { position: new THREE.Vector3(), quaternion: new THREE.Quaternion() };
    this.moveTo(this.t[0]);
  }

  get end() {
    return this.t[this.t.length - 1];
  }

  // Frames i and i + 1 are around the time, which is the fraction s of the way between them.
  moveTo(time) {
    const last = this.t.length - 1;
    let low = 0, high = last;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.t[middle] <= time) low = middle;
      else high = middle;
    }
    this.i = low;
    this.s = high > low ? Math.min(1, Math.max(0, (time - this.t[low]) / (this.t[high] - this.t[low]))) : 0;
  }

  // The pose of a body, −1 for the world.
  pose(body, position, quaternion) {
    if (body < 0) {
      position.set(0, 0, 0);
      quaternion.identity();
    } else if (this.place[body] < 0) {
      Motion.take(this.fixedPoses[body], 0, position, quaternion);
    } else {
      Motion.take(this.poses, 7 * (this.i * this.movingCount + this.place[body]), position, quaternion);
      if (this.s === 0) return;
      const { next } = this;
      Motion.take(this.poses, 7 * ((this.i + 1) * this.movingCount + this.place[body]), next.position, next.quaternion);
      position.lerp(next.position, this.s);
      quaternion.slerp(next.quaternion, this.s);
    }
  }

  node(index, position) {
    const at = 3 * (this.i * this.nodeCount + index), width = this.s > 0 ? 3 * this.nodeCount : 0;
    const { nodes, s } = this;
    return position.set(...[0, 1, 2].map((k) => (1 - s) * nodes[at + k] + s * nodes[at + width + k]));
  }

  // All nodes, as x y z one after the other.
  allNodes(into) {
    const from = 3 * this.i * this.nodeCount, width = 3 * this.nodeCount;
    for (let k = 0; k < width; ++k)
      into[k] = this.s > 0 ? (1 - this.s) * this.nodes[from + k] + this.s * this.nodes[from + width + k] : this.nodes[from + k];
  }

  // The contacts of the nearer frame, as x y z one after the other.
  contactPoints() {
    const frame = this.i + (this.s > 0.5 ? 1 : 0);
    return this.contacts.subarray(frame > 0 ? 3 * this.contactEnd[frame - 1] : 0, 3 * this.contactEnd[frame]);
  }

  get mostContacts() {
    return this.contactEnd.reduce((most, end, k) => Math.max(most, end - (k > 0 ? this.contactEnd[k - 1] : 0)), 0);
  }

  // Positions are three numbers, quaternions w x y z.
  static take(values, at, position, quaternion) {
    position.set(values[at], values[at + 1], values[at + 2]);
    quaternion.set(values[at + 4], values[at + 5], values[at + 6], values[at + 3]);
  }
}

const run = JSON.parse(document.getElementById("data").textContent);
for (const system of run.systems) {
  system.motion = new Motion(system);
  for (const series of system.series) {
    series.t = numbers(series.t, Float64Array);
    series.values = numbers(series.values, Float64Array);
  }
}
