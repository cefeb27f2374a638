// SPDX-License-Identifier: BSD-3-Clause
// What view_*.js takes of three.js; esbuild makes one file of it, in which the rest is left out.
export {
  BackSide, Box3, BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, Curve, CylinderGeometry, DirectionalLight,
  DoubleSide, Group, HemisphereLight, InstancedMesh, LineBasicMaterial, LineSegments, Matrix4, Mesh,
  MeshStandardMaterial, PCFShadowMap, PerspectiveCamera, Quaternion, Scene, Sphere, SphereGeometry,
  TubeGeometry, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
