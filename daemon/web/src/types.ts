// Data of the daemon used by the page, as validated by decode.ts.

export const PHASES = [
  "idle", "planning", "connecting", "referencing", "routing", "freeing", "proving", "transit",
  "arming fast", "fast search", "backing off", "arming slow", "slow search", "recording", "retreat",
  "choosing", "returning", "identifying", "reporting", "recovering", "watching the links",
  "stopping", "done", "aborted", "failed",
] as const;
/** A phase unknown to this page is "unknown". */
export type Phase = (typeof PHASES)[number] | "unknown";

export const FAILURES = [
  "plan", "not-found", "plan-changed", "device", "link-not-ready", "contact-fault", "contact-closed",
  "arm-refused", "no-contact", "contact-too-early", "unexpected-contact", "still-in-contact",
  "readings-disagree", "too-many-revoked", "contact-silent", "computer-busy", "robot-silent", "move-refused",
  "not-following", "stopped-elsewhere", "timeout", "stop-unconfirmed", "journal", "identify",
  "report", "attended", "controller-test", "unexpected-event",
] as const;
export type FailureKind = (typeof FAILURES)[number] | "unknown";

export const MODES = ["T1", "T2", "AUT", "EXT"] as const;
export type OperatingMode = (typeof MODES)[number] | "unknown";

export interface RobotLink {
  mode: OperatingMode;
  overridePercent: number | null;
  cycleMs: number | null;
  jitterMs: number | null;
  longestGapMs: number | null;
  packets: number | null;
  gaps: number | null;
  badPackets: number | null;
  late: number | null;
  replies: number | null;
  replyP99Ms: number | null;
  replyMaxMs: number | null;
}

export interface ContactLink {
  firmware: string;
  inContact: boolean | null;
  loopOk: boolean | null;
  selfTestOk: boolean | null;
  frames: number | null;
  crcErrors: number | null;
  gaps: number | null;
  roundTripP99Ms: number | null;
  clockSigmaUs: number | null;
  lateP50Ms: number | null;
  lateWorstMs: number | null;
  lateLimitMs: number | null;
}

/** Motion of the arm according to the newest packet of the controller. */
export const ARM_MOTIONS = ["moving", "at rest", "unknown"] as const;
export type ArmMotion = (typeof ARM_MOTIONS)[number];

export interface Status {
  seq: number;
  session: number;
  kind: Kind;
  phase: Phase;
  running: boolean;
  target: string;
  touches: number;
  planned: number;
  residualMm: number | null;
  goalMm: number | null;
  u95Mm: number | null;
  finding: boolean;
  /** Progress of planning, 0 to 1; null: no planning, or unknown. */
  plannedShare: number | null;
  timeLeftS: number | null;
  arm: { motion: ArmMotion; packetAgeS: number | null };
  waiting: { robot: boolean; contact: boolean; leftS: number | null; start: string } | null;
  /** Of cell file and plan, in English. */
  warnings: string[];
  interruptions: number;
  busyRepeats: number;
  busyLeftS: number | null;
  failure: { kind: FailureKind; detail: string } | null;
  /** After identification. */
  outcome: Outcome | null;
  reasons: string[];
  links: { open: boolean; robot: RobotLink; contact: ContactLink } | null;
  interrupted: { session: number; touches: number; planned: number; started: string } | null;
  version: string;
}

/** Outcome of a session (daemon/result/outcome.h). */
export const OUTCOMES = [
  "published", "withheld", "holds", "does_not_hold", "undecided", "qualified", "not_qualified", "found",
  "nothing_met", "updated", "nothing_changed", "update_withheld",
] as const;
export type OutcomeKind = (typeof OUTCOMES)[number];
export const NOT_AS_STATED = [
  "noise-above-stated", "overtravel-too-long", "delay-not-as-stated", "radius-not-as-stated",
] as const;
export interface OutcomeChange {
  kind: Change;
  name: string;
  touch: number | null;
  value: number;
  /** k = 2. */
  u: number;
  unit: string;
}
export interface FoundSphere {
  target: string;
  centreMm: Point;
  uMm: number | null;
  touches: number;
  movedMm: number | null;
  /** Axis of a positioner that carries it, whose frame centreMm is in, and angles while it was touched. */
  on: string;
  taughtDeg: number[];
}
export interface Outcome {
  kind: OutcomeKind;
  good: boolean;
  touches: number;
  /** Result of a check: TCP shift with its U (k = 2). */
  shiftMm: number | null;
  uShiftMm: number | null;
  change: OutcomeChange | null;
  notFound: string[];
  unsteady: string[];
  remedy: Advice;
  spheres: FoundSphere[];
  notAsStated: (typeof NOT_AS_STATED)[number][];
}

export type TouchSet = "fit" | "check";
export type Point = [number, number, number];

export interface Touch {
  session: number;
  index: number;
  target: string;
  set: TouchSet;
  joints: number[];
  positioner: number[];
  tip: Point | null;
  residualMm: number | null;
  u95Mm: number | null;
}

export interface RobotPosture {
  session: number;
  joints: number[];
  /** Degrees of a positioner's axes; empty without one. */
  positioner: number[];
}

/** 3x4, row-major. */
export type Frame = number[];

export interface Joint {
  name: string;
  /** Direction of travel of a linear unit, whose positions are in mm; null: it turns, in degrees. */
  along: Point | null;
  sign: number;
  offsetDeg: number;
  behind: Frame;
  radiusMm: number;
}

/** An axis of a positioner: its frame with all axes at 0, about whose z it turns. */
export interface TableAxis {
  name: string;
  sign: number;
  frame: Frame;
}

/** `on`: axis of a positioner that carries it, "" the floor; its place is that with all axes at 0. */
export interface Carried {
  on: string;
}

export interface SceneTarget extends Carried {
  id: string;
  kind: string;
  diameterMm: number;
  centre: Point | null;
  box: [Point, Point] | null;
}

export type Solid = Carried & (
  | { shape: "box"; id: string; frame: Frame; size: Point }
  | { shape: "cylinder"; id: string; frame: Frame; diameterMm: number; heightMm: number }
  | { shape: "mesh"; id: string; frame: Frame; vertices: number[]; triangles: number[] });

export interface Scene {
  session: number;
  robot: string;
  base: Frame;
  joints: Joint[];
  positioner: TableAxis[];
  flange: Frame;
  tool: { frame: Frame; radiusMm: number; tipLengthMm: number; tipRadiusMm: number };
  targets: SceneTarget[];
  stands: Solid[];
  obstacles: Solid[];
  up: Point;
  floorMm: number | null;
}

export interface PlannedTouch {
  index: number;
  target: string;
  set: TouchSet;
  joints: number[];
  positioner: number[];
  /** Waypoints from the touch before; the last is the stand-off. */
  way: number[][];
  tip: Point;
}

export interface Summary {
  touches: number;
  meanMm: number | null;
  maxMm: number | null;
}

/** In the language of the request. */
export interface VerdictFinding {
  severity: "withholds" | "warns" | "informs";
  words: string;
}

export interface Result {
  publish: boolean;
  scope: "workspace" | "near targets";
  findings: VerdictFinding[];
  before: Summary;
  after: Summary;
  check: Summary;
  nearTargetsMm: number | null;
  workspaceMm: number | null;
  nominalWorkspaceMm: number | null;
  /** Its U (k = 2). */
  nominalWorkspaceUMm: number | null;
}

export interface Figures {
  session: number;
  state: string;
  outcome: Outcome | null;
  touches: Touch[];
  result: Result | null;
}

export const STATES = ["running", "interrupted", "aborted", "failed", "done", "damaged"] as const;
export type SessionState = (typeof STATES)[number] | "unknown";

export const KINDS = ["calibrate", "qualify", "find", "dry-run", "check"] as const;
export type Kind = (typeof KINDS)[number] | "unknown";

export interface SessionRow {
  id: number;
  kind: Kind;
  started: string;
  ended: string;
  state: SessionState;
  cell: string;
  touches: number;
  planned: number;
  failure: string;
  /** Of a completed session; null: not recorded. */
  outcome: Outcome | null;
  /** Of a completed calibration; null otherwise. */
  published: boolean | null;
}

export interface DriftRow {
  session: number;
  ended: string;
  publish: boolean;
  fitMm: number | null;
  checkMm: number | null;
  workspaceMm: number | null;
  zeros: { joint: string; deg: number; sigmaDeg: number | null }[];
}

// Control chart of the checks of a calibration.
export const DRIFT_STATES = ["too_few", "in_control", "warns", "alarms", "unknown"] as const;
export type DriftState = (typeof DRIFT_STATES)[number];
export const ADVICE = ["none", "check_again", "let_it_warm_up", "re_measure_tcp", "recalibrate"] as const;
export type Advice = (typeof ADVICE)[number];
export const CHANGES = ["tool", "sphere", "joint", "growth", "touch", "positioner"] as const;
export type Change = (typeof CHANGES)[number];
export const HOLDINGS = ["holds", "does_not_hold", "unknown"] as const;
export type Holding = (typeof HOLDINGS)[number];
/** Decided by cellcald at the time of its answer. */
export interface Standing {
  holds: Holding;
  /** Evidence is the newest decided check; otherwise the calibration itself. */
  byCheck: boolean;
  evidenceS: number;
  /** Null: an emulated cell, whose clock gives no age. */
  dueS: number | null;
}
export interface DriftPoint {
  session: number;
  timeS: number;
  /** Null: undecided. */
  holds: boolean | null;
  /** Reason for the exclusion. */
  leftOut: string | null;
  /** Relative to the chart's centre, flange frame. */
  offMm: Point | null;
  ewma: number;
  cusum: number;
  /** Relative to the nearer alarm limit. */
  share: number;
  state: DriftState;
  temperatureC: number | null;
}
export interface DriftTrend {
  shape: "step" | "creep";
  since: number;
  sinceS: number;
  offMm: number;
  uOffMm: number | null;
  mmPerMonth: number | null;
  uMmPerMonth: number | null;
  cause: Change | null;
  causeName: string;
  probability: number;
}
/** The newest decided check, where it does not hold; `since`: the first one of the uninterrupted series. */
export interface DriftNotHeld {
  session: number;
  timeS: number;
  since: number;
  sinceS: number;
  shiftMm: number | null;
  uShiftMm: number | null;
  cause: Change | null;
  causeName: string;
  probability: number;
}
export interface ControlLimits {
  ewma: number;
  cusum: number;
  runLength: number;
}
export interface DriftChart {
  calibration: number;
  /** End of its session, and its cell file. */
  calibrated: string;
  cell: string;
  /** Null: of a daemon that does not state it. */
  standing: Standing | null;
  state: DriftState;
  advice: Advice;
  counted: number;
  least: number;
  /** Checks after the newest decided one, and the time of that one; 0: none. */
  undecided: number;
  decidedS: number;
  warns: ControlLimits;
  alarms: ControlLimits;
  trend: DriftTrend | null;
  notHeld: DriftNotHeld | null;
  points: DriftPoint[];
  /** Of other calibrations of the cell, each relative to its own centre. */
  others: { calibration: number; points: DriftPoint[] }[];
  events: DriftEvent[];
}
/** A calibration that came into use; its changes as text of the daemon, in the page's language. */
export interface DriftEvent {
  session: number;
  timeS: number;
  words: string;
}
/** SVG of the daemon; empty: nothing to draw. */
export interface PlotsSeen {
  beforeAfter: string;
  byJoint: string[];
  errorMap: string;
}
/** CELLCAL_ADVICE on the controller; `trouble`: why it is not the newest value, as text of the daemon. */
export interface AdviceStatus {
  value: number | null;
  acknowledgedAt: string;
  trouble: string;
}
export interface DriftSeen {
  rows: DriftRow[];
  checks: DriftChart | null;
  controller: AdviceStatus | null;
}

export const STEPS = ["cell", "robot", "spheres", "doctor", "qualify", "dry-run", "first", "calibration"] as const;
export type StepName = (typeof STEPS)[number];
export interface StepSeen {
  step: StepName;
  state: "todo" | "done" | "wrong";
  words: string;
  session: number | null;
}
export interface Readiness {
  cell: string;
  robot: string;
  spheres: number;
  placed: number;
  next: StepName | null;
  steps: StepSeen[];
}

/** Checks of the doctor (daemon/doctor). */
export const CHECKS = [
  "configuration", "cell file", "cell itself", "plan", "required accuracy", "robot geometry", "controller files", "unattended start", "daemon",
  "real time", "wires", "plant", "sparkplug", "doctor", "robot link", "contact link", "contact access", "contact port",
  "contact adapter", "contact sensor", "contact configuration", "contact board", "contact delivery",
  "contact circuit", "contact self-test", "contact touch", "contact clock", "contact line", "rsi port",
  "rsi packets", "rsi sender", "rsi cycle", "rsi decimals", "rsi elements", "rsi state", "rsi contact input", "rsi tool", "controller's model",
  "rsi replies", "rsi reply times", "rsi joint angles", "rsi stop", "eki connection", "eki states", "eki elements",
  "eki decimals", "eki readiness", "eki contact input", "eki joint angles",
] as const;
export type Check = (typeof CHECKS)[number];

export interface Finding {
  check: string;
  known: Check | null;
  outcome: "ok" | "warning" | "failed" | "skipped";
  found: string;
  advice: string;
}
export interface Doctor {
  cell: string;
  running: boolean;
  hint: string;
  ended: string;
  green: boolean;
  checks: Finding[];
}

/** A published calibration of the cell. */
export interface Version {
  session: number;
  ended: string;
  workspace: boolean;
  predictedMm: number | null;
  u95Mm: number | null;
  active: boolean;
  /** Not empty: damaged; reason and remedy. */
  trouble: string;
  activated: { time: string; who: string; reason: string } | null;
}
export interface Comparison {
  /** Null: different nominal arm or tool. */
  meanMm: number | null;
  maxMm: number | null;
  expectedMm: number | null;
  moved: string[];
  /** Parameters present in one of the two only. */
  onlyBefore: string[];
  onlyAfter: string[];
}

export const PROPOSALS = ["calibrate", "check", "activate", "schedule", "priors"] as const;
export interface Proposal {
  id: string;
  kind: (typeof PROPOSALS)[number];
  session: number | null;
  text: string;
  by: string;
  reason: string;
  received: string;
  stand: "open" | "accepted" | "refused";
  file: string;
  decided: string;
  decidedBy: string;
}
export interface ProposalsSeen {
  problem: string;
  proposals: Proposal[];
}

/** Sessions that begin without a person. */
export interface Schedule {
  unattended: boolean;
  held: boolean;
  /** Beginning of the current or next window; null: none. */
  nextS: number | null;
}

export type Role = "look" | "operate" | "administer";
