// 3D view of the cell: three.js, rendered only after changes.

import {
  AmbientLight, Box3, BoxGeometry, BufferGeometry, CanvasTexture, CapsuleGeometry, Color, CylinderGeometry,
  DirectionalLight, Float32BufferAttribute, Group, Line, LineBasicMaterial, LineDashedMaterial,
  Matrix4, Mesh, MeshStandardMaterial, OctahedronGeometry, PerspectiveCamera,
  SRGBColorSpace, Scene as Stage, SphereGeometry, Sprite, SpriteMaterial, Vector3, WebGLRenderer, GridHelper,
  type Material, type Object3D,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { shortened } from "../format";
import { carried, inverse, origin, place, posture, upright } from "../kinematics";
import type { Frame, PlannedTouch, Point, Scene, Solid, Touch } from "../types";

export type Side = "front" | "side" | "top" | "fit";

const M_PER_MM = 1e-3;
const Z = new Vector3(0, 0, 1);
const SIDES: Record<Side, [number, number, number]> = {
  fit: [1.5, -1.25, 0.75], front: [2.2, 0, 0.25], side: [0, -2.2, 0.25], top: [0.01, 0, 2.5],
};
const PIN_MM = 70; // from the contact outwards
const MARK_MM = 9;
const NEXT_MM = 15;
/** Drawn ways to the next touches, and lines of each. */
const MOST_WAYS = 6, WAY_STEPS = 8;
const EASE_MS = 180;
const PEDESTAL_MM = 12;
const FOV_DEG = 38;
const WIDE = 1.35;
/** Of the canvas of a name. */
const NAME_FONT = "600 44px system-ui, sans-serif", NAME_PX = 64, NAME_BEGIN_PX = 26, NAME_M = 0.085;

const point = ([x, y, z]: Point) => new Vector3(x, y, z).multiplyScalar(M_PER_MM);
function matrix(frame: Frame): Matrix4 {
  const row = (k: number) => [0, 1, 2, 3].map((i) => (frame[4 * k + i] ?? 0) * (i === 3 ? M_PER_MM : 1));
  const [a, b, c] = [row(0), row(1), row(2)];
  return new Matrix4().set(
    a[0]!, a[1]!, a[2]!, a[3]!, b[0]!, b[1]!, b[2]!, b[3]!, c[0]!, c[1]!, c[2]!, c[3]!, 0, 0, 0, 1);
}

/** Capsule between two points [m]. */
function rod(from: Vector3, to: Vector3, radius: number, material: Material): Mesh {
  const along = to.clone().sub(from);
  const length = along.length();
  const mesh = new Mesh(new CapsuleGeometry(radius, length, 6, 20), material);
  mesh.position.copy(from).addScaledVector(along, 0.5);
  if (length > 1e-9) mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), along.divideScalar(length));
  return mesh;
}

function free(object: Object3D): void {
  object.traverse((part) => {
    if (part instanceof Mesh || part instanceof Line) (part.geometry as BufferGeometry).dispose();
    if (part instanceof Sprite) part.material.map?.dispose();
  });
  object.clear();
}

export class CellView {
  private readonly renderer = new WebGLRenderer({ antialias: true, alpha: true });
  private readonly stage = new Stage();
  private readonly camera = new PerspectiveCamera(FOV_DEG, 1, 0.02, 60);
  private readonly controls: OrbitControls;
  /** The base frame, turned so that its `up` is the stage's z. */
  private readonly room = new Group();
  private readonly arm = new Group();
  /** Surroundings and touches by what carries them: "" the floor, else an axis of the positioner. */
  private readonly still = new Map<string, Group>();
  private readonly touches = new Map<string, Group>();
  private readonly size: ResizeObserver;
  private scene: Scene | null = null;
  private parts: Group[] = [];
  private up = Z;
  private centre = new Vector3(0.6, 0, 0.6);
  private reach = 1.5;
  private drawn: number[] = [];
  private aim: number[] = [];
  private begun = 0;
  private from: number[] = [];
  private waiting = false;
  private looked = false;

  /** Throws where the browser has no WebGL. */
  constructor(private readonly box: HTMLElement) {
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    box.append(this.renderer.domElement);
    this.camera.up.copy(Z);
    this.room.matrixAutoUpdate = false;
    this.room.add(this.arm);
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(2, -3, 5);
    const back = new DirectionalLight(0xffffff, 0.7);
    back.position.set(-3, 3, 2);
    this.stage.add(new AmbientLight(0xffffff, 1.3), sun, back, this.room);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enableZoom = true;
    this.controls.addEventListener("change", () => this.draw_soon());
    this.size = new ResizeObserver(() => this.fit_size());
    this.size.observe(box);
  }

  close(): void {
    this.size.disconnect();
    this.controls.dispose();
    for (const group of [this.arm, ...this.still.values(), ...this.touches.values()]) free(group);
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }

  show_scene(scene: Scene): void {
    const same = this.scene?.joints.length === scene.joints.length;
    this.scene = scene;
    this.up = new Vector3(...scene.up);
    this.room.matrix.copy(matrix(upright(scene.up)));
    this.still.forEach(free);
    free(this.arm);
    this.add_surroundings(scene);
    this.add_arm(scene);
    this.frame_scene(scene);
    if (!this.looked) this.look_from("fit");
    this.looked = true;
    const aim = same && this.aim.length === positions_of(scene) ? this.aim : [];
    this.drawn = [];
    if (aim.length > 0) this.move_to(aim.slice(0, scene.joints.length), aim.slice(scene.joints.length));
    this.draw_soon();
  }

  /** Animates to the posture, unless the user prefers reduced motion. */
  move_to(joints: number[], positioner: number[]): void {
    if (!this.scene || joints.length !== this.scene.joints.length) {
      this.aim = joints;
      this.arm.visible = false; // unknown posture
      this.draw_soon();
      return;
    }
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const aim = [...joints, ...this.scene.positioner.map((_, i) => positioner[i] ?? 0)];
    this.from = this.drawn.length === aim.length && !calm ? this.drawn : aim;
    this.aim = aim;
    this.begun = performance.now();
    this.arm.visible = true;
    this.draw_soon();
  }

  /** `next`: number of the current touch; -1: none. */
  show_touches(plan: PlannedTouch[], made: Touch[], next: number): void {
    this.touches.forEach(free);
    const done = new Set(made.map((touch) => touch.index));
    for (const touch of plan) {
      if (done.has(touch.index)) continue;
      const is_next = touch.index === next;
      this.pin(touch, touch.tip_mm, is_next ? "next" : "planned", is_next ? NEXT_MM : MARK_MM * 0.6);
    }
    this.show_ways(plan.filter((touch) => !done.has(touch.index)), made, next);
    for (const touch of made) if (touch.tip_mm) this.pin(touch, touch.tip_mm, touch.set, MARK_MM);
    this.draw_soon();
  }

  /** Way of the tip to the touches to come, joint by joint between waypoints; the nearest ones, else the lines hide the cell. */
  private show_ways(ahead: PlannedTouch[], made: Touch[], next: number): void {
    let from = made.at(-1)?.joints_deg ?? [];
    for (const touch of ahead.slice(0, MOST_WAYS)) {
      const corners = [from, ...touch.way_deg].filter((one) => one.length === this.scene?.joints.length);
      const points = corners.slice(1).flatMap((to, k) => this.tips_between(corners[k] ?? to, to));
      const is_next = touch.index === next;
      const style = { color: this.colour(is_next ? "next" : "planned"), transparent: true, opacity: is_next ? 1 : 0.45 };
      if (points.length > 1) this.group(this.touches, "").add(new Line(new BufferGeometry().setFromPoints(points), new LineBasicMaterial(style)));
      from = touch.joints_deg;
    }
  }

  private tips_between(from: number[], to: number[]): Vector3[] {
    return Array.from({ length: WAY_STEPS + 1 }, (_, k) => {
      const at = this.scene && posture(this.scene, to.map((end, i) => (from[i] ?? end) + ((end - (from[i] ?? end)) * k) / WAY_STEPS));
      return at ? point(origin(at.tip)) : null;
    }).filter((one) => one !== null);
  }

  look_from(side: Side): void {
    const [x, y, z] = SIDES[side];
    this.camera.position.copy(this.centre).addScaledVector(new Vector3(x, y, z), this.reach);
    this.controls.target.copy(this.centre);
    this.controls.update();
    this.draw_soon();
  }

  private group(all: Map<string, Group>, on: string): Group {
    const known = all.get(on);
    if (known) return known;
    const made = new Group();
    made.matrixAutoUpdate = false;
    all.set(on, made);
    this.room.add(made);
    return made;
  }

  private colour(name: string): Color {
    return new Color(getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim() || "#888");
  }
  private paint(name: string, opacity = 1): MeshStandardMaterial {
    return new MeshStandardMaterial({
      color: this.colour(name), roughness: 0.65, metalness: 0.05, transparent: opacity < 1, opacity,
      depthWrite: opacity >= 1,
    });
  }

  private add_surroundings(scene: Scene): void {
    const steel = this.paint("steel"), stand = this.paint("stand");
    for (const target of scene.targets) {
      if (!target.centre_mm) continue;
      const radius = Math.max(0.004, ((target.diameter_mm ?? 0) / 2) * M_PER_MM);
      const ball = new Mesh(new SphereGeometry(radius, 32, 24), steel);
      ball.position.copy(point(target.centre_mm));
      this.group(this.still, target.on).add(ball, this.words(target.id, ball.position, radius));
    }
    for (const one of scene.stands) this.add_solid(one, stand);
    for (const one of scene.obstacles) this.add_solid(one, this.paint("obstacle", 0.55));
    const floor = new GridHelper(4, 16, this.colour("grid-strong"), this.colour("grid"));
    floor.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), this.up);
    floor.position.copy(this.up).multiplyScalar((scene.floor_mm ?? lowest_mm(scene)) * M_PER_MM);
    this.group(this.still, "").add(floor);
  }

  private add_solid(solid: Solid, material: Material): void {
    const mesh = new Mesh(shape_of(solid), material);
    mesh.matrixAutoUpdate = false;
    mesh.matrix.copy(matrix(solid.frame));
    if (solid.shape === "cylinder") mesh.matrix.multiply(new Matrix4().makeRotationX(Math.PI / 2));
    this.group(this.still, solid.on).add(mesh);
  }

  /** One group per joint, positioned as a whole, and one for the flange. */
  private add_arm(scene: Scene): void {
    const light = this.paint("arm"), dark = this.paint("arm-joint"), tool = this.paint("tool");
    this.parts = scene.joints.map((joint) => {
      const group = new Group();
      const [a, d] = [(joint.behind[3] ?? 0) * M_PER_MM, (joint.behind[11] ?? 0) * M_PER_MM];
      const y = (joint.behind[7] ?? 0) * M_PER_MM;
      const radius = (joint.radius_mm ?? 0) * M_PER_MM * 0.72;
      const knee = new Vector3(0, 0, d), end = new Vector3(a, y, d);
      if (Math.abs(d) > 1e-3) group.add(rod(new Vector3(), knee, radius, light));
      if (end.distanceTo(knee) > 1e-3) group.add(rod(knee, end, radius, light));
      const hub = new Mesh(new CylinderGeometry(radius * 1.12, radius * 1.12, radius * 2.3, 28), dark);
      hub.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), Z);
      group.add(hub);
      return group;
    });
    const flange = new Group();
    const tip = new Vector3().setFromMatrixPosition(matrix(scene.tool.frame));
    const length = tip.length();
    const slim = Math.min(length, (scene.tool.tip_length_mm ?? 0) * M_PER_MM);
    const neck = tip.clone().multiplyScalar(length > 0 ? (length - slim) / length : 0);
    if (length > slim) flange.add(rod(new Vector3(), neck, (scene.tool.radius_mm ?? 0) * M_PER_MM, tool));
    flange.add(rod(neck, tip, Math.max(0.003, (scene.tool.tip_radius_mm ?? 0) * M_PER_MM), dark));
    this.parts.push(flange);
    const foot = new Mesh(new CylinderGeometry(0.17, 0.2, PEDESTAL_MM * M_PER_MM, 32), dark);
    foot.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), Z);
    const base = new Group();
    base.matrixAutoUpdate = false;
    base.matrix.copy(matrix(scene.base));
    base.add(foot);
    for (const part of this.parts) part.matrixAutoUpdate = false;
    this.arm.add(base, ...this.parts);
    this.arm.visible = false; // until a posture is known
  }

  private frame_scene(scene: Scene): void {
    const box = new Box3(new Vector3(-0.2, -0.3, 0), new Vector3(0.3, 0.3, 0.9)).applyMatrix4(matrix(scene.base));
    for (const target of scene.targets) if (target.centre_mm) box.expandByPoint(point(target.centre_mm));
    box.applyMatrix4(this.room.matrix).getCenter(this.centre);
    this.reach = Math.max(0.6, 0.62 * box.max.distanceTo(box.min));
  }

  private pin(touch: PlannedTouch | Touch, tip: Point, kind: "planned" | "fit" | "check" | "next", mark_mm: number): void {
    const target = this.scene?.targets.find((one) => one.id === touch.target);
    // Without angles where it was touched in the base frame.
    const on = touch.positioner_deg.length > 0 ? target?.on ?? "" : "";
    const at = point(this.scene ? place(inverse(carried(this.scene, on, touch.positioner_deg)), tip) : tip);
    const outwards = target?.centre_mm ? at.clone().sub(point(target.centre_mm)) : this.up.clone();
    if (outwards.length() < 1e-6) outwards.copy(this.up);
    const end = at.clone().addScaledVector(outwards.normalize(), PIN_MM * M_PER_MM);
    const line = new BufferGeometry().setFromPoints([at, end]);
    const style = { color: this.colour(kind) };
    const stroke = kind === "planned"
      ? new LineDashedMaterial({ ...style, dashSize: 0.008, gapSize: 0.006 })
      : new LineBasicMaterial(style);
    const stem = new Line(line, stroke);
    if (kind === "planned") stem.computeLineDistances();
    const size = mark_mm * M_PER_MM;
    // Sphere and octahedron are distinguishable without colour.
    const head = new Mesh(kind === "check" ? new OctahedronGeometry(size * 1.35) : new SphereGeometry(size, 12, 8),
                          this.paint(kind));
    head.position.copy(end);
    this.group(this.touches, on).add(stem, head);
  }

  private words(text: string, beside: Vector3, radius: number): Sprite {
    const canvas = document.createElement("canvas");
    const ctx = canvas.getContext("2d");
    if (ctx) {
      const name = shortened(text);
      ctx.font = NAME_FONT;
      canvas.width = NAME_BEGIN_PX + Math.ceil(ctx.measureText(name).width);
      canvas.height = NAME_PX; // a new size clears the font
      ctx.font = NAME_FONT;
      ctx.textBaseline = "middle";
      ctx.fillStyle = `#${this.colour("ink").getHexString()}`;
      ctx.fillText(name, NAME_BEGIN_PX, NAME_PX / 2);
    }
    const map = new CanvasTexture(canvas);
    map.colorSpace = SRGBColorSpace;
    const sprite = new Sprite(new SpriteMaterial({ map, depthTest: false }));
    sprite.scale.set((NAME_M * canvas.width) / NAME_PX, NAME_M, 1);
    sprite.center.set(0, 0.95); // below and to the right, clear of the pins above
    sprite.position.copy(beside).addScaledVector(this.up, -radius);
    return sprite;
  }

  private fit_size(): void {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    // The same horizontal extent on an upright screen as on a wide one.
    const narrow = Math.max(1, WIDE / this.camera.aspect);
    this.camera.fov = (360 / Math.PI) * Math.atan(Math.tan((FOV_DEG * Math.PI) / 360) * narrow);
    this.camera.updateProjectionMatrix();
    this.draw_soon();
  }

  private draw_soon(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  /** What the positioner carries; where its angles are unknown, at 0. */
  private turn_carried(): void {
    const { scene, aim } = this;
    if (!scene) return;
    const turned = aim.length === positions_of(scene) ? this.drawn.slice(scene.joints.length) : [];
    for (const all of [this.still, this.touches])
      all.forEach((group, on) => group.matrix.copy(matrix(carried(scene, on, turned))));
  }

  private draw(): void {
    const share = Math.min(1, (performance.now() - this.begun) / EASE_MS);
    if (this.scene && this.aim.length === positions_of(this.scene)) {
      this.drawn = this.aim.map((angle, i) => (this.from[i] ?? angle) + ((angle - (this.from[i] ?? angle)) * share));
      const at = posture(this.scene, this.drawn.slice(0, this.scene.joints.length));
      at?.joints.forEach((joint, i) => this.parts[i]?.matrix.copy(matrix(joint.turned)));
      if (at) this.parts[at.joints.length]?.matrix.copy(matrix(at.flange));
      if (share < 1) this.draw_soon();
      else this.from = this.aim;
    }
    this.turn_carried();
    this.renderer.render(this.stage, this.camera);
  }
}

/** Of arm and positioner. */
const positions_of = (scene: Scene): number => scene.joints.length + scene.positioner.length;

function shape_of(solid: Solid): BufferGeometry {
  if (solid.shape === "box") {
    const [x, y, z] = solid.size_mm;
    return new BoxGeometry(x * M_PER_MM, y * M_PER_MM, z * M_PER_MM);
  }
  if (solid.shape === "cylinder") {
    const radius = ((solid.diameter_mm ?? 0) / 2) * M_PER_MM;
    return new CylinderGeometry(radius, radius, (solid.height_mm ?? 0) * M_PER_MM, 24);
  }
  const mesh = new BufferGeometry();
  mesh.setAttribute("position", new Float32BufferAttribute(solid.vertices_mm.map((value) => value * M_PER_MM), 3));
  mesh.setIndex(solid.triangles);
  mesh.computeVertexNormals();
  return mesh;
}

/** Height of the drawn floor where the cell file states none: below the lowest stand and target, or the arm's foot. */
function lowest_mm({ stands, targets, up: [x, y, z] }: Scene): number {
  const height = (at: Point) => x * at[0] + y * at[1] + z * at[2];
  return Math.min(0, ...stands.map((one) => height(origin(one.frame)) - (one.shape === "cylinder" ? (one.height_mm ?? 0) / 2 : 0)),
                  ...targets.map((one) => (one.centre_mm ? height(one.centre_mm) : 0)));
}
