/** Draws the model of the simulation: its visual shapes, the goal, and the force with which the visitor pulls. */

import {
  AmbientLight,
  Box3,
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  CapsuleGeometry,
  Color,
  CylinderGeometry,
  DirectionalLight,
  DoubleSide,
  Fog,
  Group,
  HemisphereLight,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  Mesh,
  MeshStandardMaterial,
  PCFSoftShadowMap,
  PerspectiveCamera,
  PlaneGeometry,
  Raycaster,
  RepeatWrapping,
  SRGBColorSpace,
  Scene,
  Sphere,
  SphereGeometry,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const VISUAL = 1;
const HIDDEN = [2, 3, 4, 5]; // groups of the robots' collision shapes
const FLOOR = 12; // edge length [m]
const THEMES = {
  light: { ground: 0xe8edf2, tiles: ["#dfe5eb", "#d3dbe3"], goal: 0x0f9d58 },
  dark: { ground: 0x10161c, tiles: ["#202a33", "#28343f"], goal: 0x3ddc84 },
};

export class Drawing {
  constructor(canvas, simulation) {
    Object.assign(this, { canvas, simulation });
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.scene = new Scene();
    this.addCamera();
    this.addLights();
    this.shapes = [];
    const groups = simulation.model.geom_group;
    const hasVisuals = groups.includes(VISUAL);
    for (let geom = 0; geom < simulation.model.ngeom; geom++) {
      if (!hasVisuals || !HIDDEN.includes(groups[geom])) this.addShape(geom);
    }
    this.addGoal();
    this.frame();
    this.pulling = new Line(new BufferGeometry().setFromPoints([new Vector3(), new Vector3()]));
    this.pulling.material = new LineBasicMaterial({ color: 0xff7a1a, depthTest: false });
    this.hand = new Mesh(new SphereGeometry(0.012, 16, 12), new MeshStandardMaterial({ color: 0xff7a1a }));
    this.pulling.frustumCulled = this.pulling.visible = this.hand.visible = false;
    this.scene.add(this.pulling, this.hand);
    this.setTheme(matchMedia("(prefers-color-scheme: dark)"));
    this.fit();
    new ResizeObserver(() => this.fit()).observe(canvas.parentElement);
    this.raycaster = new Raycaster();
  }

  addCamera() {
    const { pos, target, fov_y: fov } = this.simulation.facts.camera ?? { pos: [1.3, -1.3, 1], target: [0, 0, 0.4], fov_y: 45 };
    this.camera = new PerspectiveCamera(fov, 1, 0.02, 40);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(...pos);
    this.orbit = new OrbitControls(this.camera, this.canvas);
    Object.assign(this.orbit, { maxPolarAngle: 1.55, minDistance: 0.3, maxDistance: 8, rotateSpeed: 0.7 });
    this.orbit.target.set(...target);
    this.orbit.update();
  }

  /** Move the camera back until it shows all shapes and the goals, and look at their middle. */
  frame() {
    const { model, data, facts } = this.simulation;
    const points = (facts.goal ? [facts.goal.low, facts.goal.high] : []).map((point) => ({ point, radius: 0 }));
    for (const { geom, mesh } of this.shapes) {
      if (mesh === this.floor) continue;
      const point = [...data.geom_xpos.subarray(3 * geom, 3 * geom + 3)];
      points.push({ point, radius: model.geom_rbound[geom] });
    }
    const box = new Box3();
    for (const { point, radius } of points) box.union(new Box3().setFromCenterAndSize(new Vector3(...point), new Vector3().setScalar(2 * radius)));
    const sphere = box.getBoundingSphere(new Sphere());
    const way = this.camera.position.clone().sub(this.orbit.target).normalize();
    const distance = (0.85 * sphere.radius) / Math.sin((this.camera.fov * Math.PI) / 360);
    this.orbit.target.copy(sphere.center);
    this.camera.position.copy(sphere.center).addScaledVector(way, distance);
    this.orbit.update();
    this.orbit.saveState();
  }

  addLights() {
    this.sky = new HemisphereLight(0xffffff, 0x8c97a3, 1.6);
    this.sky.position.set(0, 0, 1);
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(1.5, -1.2, 3);
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    Object.assign(sun.shadow.camera, { left: -1.5, right: 1.5, top: 1.5, bottom: -1.5, near: 0.5, far: 7 });
    sun.shadow.radius = 4;
    sun.shadow.normalBias = 0.01;
    this.scene.add(this.sky, sun, new AmbientLight(0xffffff, 0.25));
  }

  addShape(geom) {
    const { model } = this.simulation;
    const [r, g, b, opacity] = model.geom_rgba.subarray(4 * geom, 4 * geom + 4);
    const floor = model.geom_type[geom] === 0;
    const geometry = floor ? new PlaneGeometry(FLOOR, FLOOR) : geometryOf(model, geom);
    if (!geometry || opacity === 0) return;
    const color = new Color().setRGB(r, g, b, SRGBColorSpace);
    const material = new MeshStandardMaterial({ color, roughness: 0.55, metalness: 0.05, opacity, transparent: opacity < 1 });
    const mesh = new Mesh(geometry, material);
    if (floor) {
      Object.assign(material, { side: DoubleSide, roughness: 1, metalness: 0 });
      material.color.set(0xffffff);
      this.floor = mesh;
    }
    Object.assign(mesh, { castShadow: !floor, receiveShadow: true, matrixAutoUpdate: false });
    mesh.userData.body = model.geom_bodyid[geom];
    this.shapes.push({ geom, mesh });
    this.scene.add(mesh);
  }

  addGoal() {
    const { facts } = this.simulation;
    this.goal = new Group();
    this.goal.visible = facts.goal !== null;
    const radius = facts.success.tolerance;
    const skin = new MeshStandardMaterial({ transparent: true, opacity: 0.3, depthWrite: false, roughness: 0.3 });
    this.ball = new Mesh(new SphereGeometry(radius, 32, 20), skin);
    this.core = new Mesh(new SphereGeometry(Math.min(0.012, radius / 3), 20, 14), new MeshStandardMaterial());
    const points = [new Vector3(), new Vector3(0, 0, -1)];
    this.drop = new Line(new BufferGeometry().setFromPoints(points), new LineDashedMaterial({ dashSize: 0.02, gapSize: 0.015 }));
    this.drop.computeLineDistances();
    this.goal.add(this.ball, this.core, this.drop);
    this.scene.add(this.goal);
  }

  /** Use the colors of the light or the dark scheme, now and when it changes. */
  setTheme(query) {
    const apply = () => {
      this.theme = THEMES[query.matches ? "dark" : "light"];
      this.scene.background = new Color(this.theme.ground);
      this.scene.fog = new Fog(this.theme.ground, 3, 9);
      this.sky.groundColor.set(query.matches ? 0x3a444e : 0x8c97a3);
      if (this.floor) this.floor.material.map = tiles(this.theme.tiles);
      this.changed = true;
    };
    query.addEventListener("change", apply);
    apply();
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    const wide = this.simulation.facts.camera?.fov_y ?? 45;
    this.camera.fov = this.camera.aspect < 1 ? Math.min(wide / this.camera.aspect, 75) : wide;
    this.camera.updateProjectionMatrix();
  }

  /** Return the nearest of the goal and the bodies that can be pulled at a place of the canvas, or null. */
  pick(x, y) {
    this.aim(x, y);
    if (this.goal.visible) {
      const [hit] = this.raycaster.intersectObject(this.ball);
      if (hit) return { goal: true, point: this.simulation.goal };
    }
    const meshes = this.shapes.map(({ mesh }) => mesh);
    const [hit] = this.raycaster.intersectObjects(meshes, false);
    const body = hit?.object.userData.body;
    if (!hit || this.simulation.model.body_weldid[body] === 0 || !this.moves(body)) return null;
    return { body, point: hit.point.toArray() };
  }

  /** Return whether a body is moved by a joint. */
  moves(body) {
    const { model } = this.simulation;
    for (let at = body; at > 0; at = model.body_parentid[at]) if (model.body_jntnum[at] > 0) return true;
    return false;
  }

  aim(x, y) {
    const box = this.canvas.getBoundingClientRect();
    const place = new Vector2((2 * (x - box.left)) / box.width - 1, 1 - (2 * (y - box.top)) / box.height);
    this.raycaster.setFromCamera(place, this.camera);
  }

  /** Return the ray through a place of the canvas, and the direction in which the camera looks. */
  ray(x, y) {
    this.aim(x, y);
    const { origin, direction } = this.raycaster.ray;
    return { origin: origin.toArray(), direction: direction.toArray(), ahead: this.camera.getWorldDirection(new Vector3()).toArray() };
  }

  /** Turn the view by two angles [rad], and change its distance by a factor. */
  turn(sideways, upward, zoom = 1) {
    const offset = this.camera.position.clone().sub(this.orbit.target);
    offset.applyAxisAngle(new Vector3(0, 0, 1), sideways);
    const side = new Vector3().crossVectors(offset, this.camera.up).normalize();
    offset.applyAxisAngle(side, upward).multiplyScalar(zoom);
    this.camera.position.copy(this.orbit.target).add(offset);
    this.orbit.update();
  }

  draw() {
    const { data, goal, success } = this.simulation;
    const positions = data.geom_xpos;
    const rotations = data.geom_xmat;
    for (const { geom, mesh } of this.shapes) {
      const [x, y, z] = positions.subarray(3 * geom, 3 * geom + 3);
      const m = rotations.subarray(9 * geom, 9 * geom + 9);
      mesh.matrix.set(m[0], m[1], m[2], x, m[3], m[4], m[5], y, m[6], m[7], m[8], z, 0, 0, 0, 1);
    }
    this.goal.position.set(...goal);
    this.drop.scale.z = Math.max(goal[2], 1e-3);
    this.drop.visible = goal[2] > 1.5 * this.simulation.facts.success.tolerance;
    const reached = success.held > 0;
    for (const part of [this.ball, this.core, this.drop]) part.material.color.set(this.theme.goal);
    this.ball.material.opacity = reached ? 0.55 : 0.3;
    this.ball.material.emissive.set(reached ? this.theme.goal : 0).multiplyScalar(0.4);
    const pulled = this.simulation.pulledPoint();
    this.pulling.visible = this.hand.visible = pulled !== null;
    if (pulled) {
      const { target } = this.simulation.pull;
      this.pulling.geometry.setFromPoints([new Vector3(...pulled), new Vector3(...target)]);
      this.hand.position.set(...target);
    }
    this.renderer.render(this.scene, this.camera);
  }
}

/** Return the geometry of a shape of the model, with its axes in z as in MuJoCo, or null if it cannot be drawn. */
function geometryOf(model, geom) {
  const [a, b, c] = model.geom_size.subarray(3 * geom, 3 * geom + 3);
  switch (model.geom_type[geom]) {
    case 2:
      return new SphereGeometry(a, 32, 20);
    case 3:
      return new CapsuleGeometry(a, 2 * b, 10, 28).rotateX(Math.PI / 2);
    case 4:
      return new SphereGeometry(1, 32, 20).scale(a, b, c);
    case 5:
      return new CylinderGeometry(a, a, 2 * b, 36).rotateX(Math.PI / 2);
    case 6:
      return new BoxGeometry(2 * a, 2 * b, 2 * c);
    case 7:
      return meshOf(model, model.geom_dataid[geom]);
    default:
      return null;
  }
}

function meshOf(model, mesh) {
  const vertex = 3 * model.mesh_vertadr[mesh];
  const face = 3 * model.mesh_faceadr[mesh];
  const vertices = Float32Array.from(model.mesh_vert.subarray(vertex, vertex + 3 * model.mesh_vertnum[mesh]));
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(vertices, 3));
  geometry.setIndex([...model.mesh_face.subarray(face, face + 3 * model.mesh_facenum[mesh])]);
  const flat = geometry.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

/** Return a texture of tiles with an edge of 25 cm. */
function tiles([first, second]) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const context = canvas.getContext("2d");
  for (const [x, y, color] of [[0, 0, first], [64, 64, first], [64, 0, second], [0, 64, second]]) {
    context.fillStyle = color;
    context.fillRect(x, y, 64, 64);
  }
  const texture = new CanvasTexture(canvas);
  texture.wrapS = texture.wrapT = RepeatWrapping;
  texture.repeat.set(FLOOR * 2, FLOOR * 2);
  texture.colorSpace = SRGBColorSpace;
  texture.anisotropy = 4;
  return texture;
}
