// Validation of received values against types.ts. Never throws and trusts nothing: wrong types become null or defaults, lists and
// texts are truncated to bounded sizes. Null where the whole object is unusable.

import {
  ARM_MOTIONS, ADVICE, CHANGES, CHECKS, DRIFT_STATES, FAILURES, HOLDINGS, KINDS, MODES, NOT_AS_STATED, OUTCOMES, PHASES, PROPOSALS, STATES, STEPS,
  type AdviceStatus, type Comparison, type ContactLink, type ControlLimits, type Doctor, type DriftChart, type DriftEvent, type DriftNotHeld, type DriftPoint, type DriftRow, type DriftSeen, type DriftTrend, type FailureKind, type Figures, type Finding, type FoundSphere, type Outcome, type OutcomeChange, type Frame, type Joint, type Kind, type Phase,
  type PlannedTouch, type PlotsSeen, type Point, type Proposal, type ProposalsSeen, type Result, type RobotLink, type Readiness, type RobotPosture, type Role,
  type Scene, type SceneTarget, type SessionRow, type Schedule, type SessionState, type Solid, type Standing, type Status, type StepSeen,
  type Summary, type TableAxis, type Touch, type TouchSet, type Version,
} from "./types";

const MOST_LETTERS = 4000;
const MOST_ITEMS = 5000;
const MOST_NUMBERS = 400_000;
const MOST_DRAWN = 4_000_000;
const MOST_JOINTS = 32;

type Fields = Record<string, unknown>;

export function parse(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
}

export const fields = (value: unknown): Fields | null =>
  typeof value === "object" && value !== null && !Array.isArray(value) ? (value as Fields) : null;
export const list = (value: unknown): unknown[] =>
  Array.isArray(value) ? value.slice(0, MOST_ITEMS) : [];
export const number = (value: unknown): number | null =>
  typeof value === "number" && Number.isFinite(value) ? value : null;
export const count = (value: unknown): number => Math.max(0, Math.trunc(number(value) ?? 0));
export const truth = (value: unknown): boolean | null => (typeof value === "boolean" ? value : null);
export const words = (value: unknown): string =>
  typeof value === "string" ? value.slice(0, MOST_LETTERS) : "";
export const one_of = <T extends string>(value: unknown, all: readonly T[]): T | "unknown" =>
  all.find((one) => one === value) ?? "unknown";
export const known = <T>(items: (T | null)[]): T[] => items.filter((one): one is T => one !== null);

function numbers(value: unknown, most = MOST_NUMBERS): number[] | null {
  if (!Array.isArray(value) || value.length > most) return null;
  return value.every((one) => number(one) !== null) ? (value as number[]) : null;
}
function point(value: unknown): Point | null {
  const three = numbers(value, 3);
  return three?.length === 3 ? (three as Point) : null;
}
function frame(value: unknown): Frame | null {
  const twelve = numbers(value, 12);
  return twelve?.length === 12 ? twelve : null;
}
const joints = (value: unknown): number[] => numbers(value, MOST_JOINTS) ?? [];
const touch_set = (value: unknown): TouchSet => (value === "check" ? "check" : "fit");

function outcome_change(value: unknown): OutcomeChange | null {
  const all = fields(value);
  const kind = CHANGES.find((one) => one === all?.kind), size = number(all?.value);
  if (!all || !kind || size === null) return null;
  return { kind, name: words(all.name), touch: number(all.touch), value: size, u: number(all.u) ?? 0, unit: words(all.unit) };
}
function found_sphere(value: unknown): FoundSphere | null {
  const all = fields(value), centreMm = point(all?.centre_mm);
  if (!all || !centreMm) return null;
  return { target: words(all.target), centreMm, uMm: number(all.u_mm), touches: count(all.touches), movedMm: number(all.moved_mm),
    on: words(all.on), taughtDeg: numbers(all.taught_deg) ?? [] };
}
const some_words = (value: unknown): string[] => list(value).map(words).filter((one) => one !== "");
function outcome(value: unknown): Outcome | null {
  const all = fields(value);
  const kind = OUTCOMES.find((one) => one === all?.kind);
  if (!all || !kind) return null;
  const shift = fields(all.tcp_shift_mm);
  return {
    kind, good: all.good === true, touches: count(all.touches),
    shiftMm: number(shift?.length), uShiftMm: number(shift?.u_length), change: outcome_change(all.change),
    notFound: some_words(all.not_found), unsteady: some_words(all.unsteady),
    remedy: ADVICE.find((one) => one === all.remedy) ?? "none",
    spheres: known(list(all.spheres).map(found_sphere)),
    notAsStated: NOT_AS_STATED.filter((one) => list(all.not_as_stated).includes(one)),
  };
}

function robot_link(value: unknown): RobotLink {
  const robot = fields(value) ?? {};
  const reply = fields(robot.reply_ms) ?? {};
  return {
    mode: MODES.find((one) => one === robot.mode) ?? "unknown",
    overridePercent: number(robot.override_percent),
    cycleMs: number(robot.cycle_ms), jitterMs: number(robot.jitter_ms),
    longestGapMs: number(robot.longest_gap_ms), packets: number(robot.packets),
    gaps: number(robot.gaps), badPackets: number(robot.bad_packets), late: number(robot.late),
    replies: number(robot.replies), replyP99Ms: number(reply.p99), replyMaxMs: number(reply.max),
  };
}

function contact_link(value: unknown): ContactLink {
  const contact = fields(value) ?? {};
  const late = fields(contact.late_ms) ?? {};
  return {
    firmware: words(contact.firmware), inContact: truth(contact.in_contact),
    loopOk: truth(contact.loop_ok), selfTestOk: truth(contact.self_test_ok),
    frames: number(contact.frames), crcErrors: number(contact.crc_errors),
    gaps: number(contact.gaps), roundTripP99Ms: number(fields(contact.round_trip_ms)?.p99),
    clockSigmaUs: number(contact.clock_sigma_us), lateP50Ms: number(late.p50),
    lateWorstMs: number(late.worst), lateLimitMs: number(late.limit),
  };
}

export function status(value: unknown): Status | null {
  const all = fields(value);
  const seq = number(all?.seq);
  if (!all || seq === null || typeof all.phase !== "string") return null;
  const waiting = fields(all.waiting);
  const failure = fields(all.failure);
  const links = fields(all.links);
  const interrupted = fields(all.interrupted);
  const arm = fields(all.arm) ?? {};
  const phase: Phase = one_of(all.phase, PHASES);
  return {
    seq, phase,
    session: count(all.session), kind: one_of(all.kind, KINDS) as Kind,
    running: all.running === true,
    target: words(all.target),
    touches: count(all.touches),
    planned: count(all.planned),
    residualMm: number(all.residual_mm),
    goalMm: number(all.goal_mm),
    u95Mm: number(all.u95_mm),
    finding: all.finding === true,
    plannedShare: number(fields(all.planning)?.done),
    timeLeftS: number(all.time_left_s),
    arm: { motion: one_of(arm.motion, ARM_MOTIONS), packetAgeS: number(arm.packet_age_s) },
    waiting: waiting && {
      robot: waiting.robot === true, contact: waiting.contact === true,
      leftS: number(waiting.left_s), start: words(waiting.start),
    },
    warnings: list(all.warnings).map(words).filter((one) => one !== ""),
    interruptions: count(all.interruptions),
    busyRepeats: count(all.busy_repeats), busyLeftS: number(all.busy_left_s),
    failure: failure && {
      kind: one_of(failure.kind, FAILURES) as FailureKind, detail: words(failure.detail),
    },
    outcome: outcome(all.outcome),
    reasons: list(all.reasons).map(words).filter((one) => one !== ""),
    links: links && {
      open: links.open === true, robot: robot_link(links.robot), contact: contact_link(links.contact),
    },
    interrupted: interrupted && {
      session: count(interrupted.session), touches: count(interrupted.touches),
      planned: count(interrupted.planned), started: words(interrupted.started),
    },
    version: words(all.version),
  };
}

export function touch(value: unknown, of_session = 0): Touch | null {
  const all = fields(value);
  const index = number(all?.index);
  if (!all || index === null || index < 0 || !Number.isInteger(index)) return null;
  return {
    session: of_session || count(all.session), index, target: words(all.target),
    set: touch_set(all.set), joints: joints(all.joints_deg), positioner: joints(all.positioner_deg), tip: point(all.tip_mm),
    residualMm: number(all.residual_mm), u95Mm: number(all.u95_mm),
  };
}

export function posture(value: unknown): RobotPosture | null {
  const all = fields(value);
  const at = joints(all?.joints_deg);
  return all && at.length > 0 ? { session: count(all.session), joints: at, positioner: joints(all.positioner_deg) } : null;
}

function joint(value: unknown): Joint | null {
  const all = fields(value);
  const behind = frame(all?.behind);
  if (!all || !behind) return null;
  return {
    name: words(all.name), along: point(all.along), sign: number(all.sign) === -1 ? -1 : 1,
    offsetDeg: number(all.offset_deg) ?? 0, behind, radiusMm: number(all.radius_mm) ?? 0,
  };
}

function target(value: unknown): SceneTarget | null {
  const all = fields(value);
  if (!all || typeof all.id !== "string") return null;
  const corners = list(all.box_mm).map(point);
  const [low, high] = corners;
  return {
    id: words(all.id), kind: words(all.kind), diameterMm: number(all.diameter_mm) ?? 0,
    centre: point(all.centre_mm), box: low && high ? [low, high] : null, on: words(all.on),
  };
}

function table_axis(value: unknown): TableAxis | null {
  const all = fields(value);
  const at = frame(all?.frame);
  return all && at && { name: words(all.name), sign: number(all.sign) === -1 ? -1 : 1, frame: at };
}

function solid(value: unknown): Solid | null {
  const all = fields(value);
  const at = frame(all?.frame);
  if (!all || !at) return null;
  const id = words(all.id), on = words(all.on);
  const size = point(all.size_mm);
  if (all.shape === "box" && size) return { shape: "box", id, on, frame: at, size };
  if (all.shape === "cylinder")
    return {
      shape: "cylinder", id, on, frame: at, diameterMm: number(all.diameter_mm) ?? 0,
      heightMm: number(all.height_mm) ?? 0,
    };
  const vertices = numbers(all.vertices_mm), triangles = numbers(all.triangles);
  if (all.shape !== "mesh" || !vertices || !triangles) return null;
  const corners = vertices.length / 3;
  const inside = triangles.every((one) => Number.isInteger(one) && one >= 0 && one < corners);
  return inside ? { shape: "mesh", id, on, frame: at, vertices, triangles } : null;
}

export function scene(value: unknown): Scene | null {
  const all = fields(value);
  const tool = fields(all?.tool);
  const base = frame(all?.base), flange = frame(all?.flange), tcp = frame(tool?.frame);
  if (!all || !tool || !base || !flange || !tcp) return null;
  const arm = list(all.joints).map(joint);
  const table = list(all.positioner).map(table_axis);
  if (arm.length === 0 || arm.length + table.length > MOST_JOINTS || arm.includes(null) || table.includes(null)) return null;
  return {
    session: count(all.session), robot: words(all.robot), base, joints: known(arm), flange,
    positioner: known(table),
    tool: {
      frame: tcp, radiusMm: number(tool.radius_mm) ?? 0,
      tipLengthMm: number(tool.tip_length_mm) ?? 0, tipRadiusMm: number(tool.tip_radius_mm) ?? 0,
    },
    targets: known(list(all.targets).map(target)),
    stands: known(list(all.stands).map(solid)),
    obstacles: known(list(all.obstacles).map(solid)),
    up: point(all.up) ?? [0, 0, 1],
    floorMm: number(all.floor_mm),
  };
}

function planned_touch(value: unknown): PlannedTouch | null {
  const all = touch(value);
  const way = list(fields(value)?.way_deg).map(joints).filter((corner) => corner.length > 0);
  return all?.tip ? { ...all, way, tip: all.tip } : null;
}
export const plan = (value: unknown): PlannedTouch[] =>
  known(list(fields(value)?.touches).map(planned_touch));

function summary(value: unknown): Summary {
  const all = fields(value) ?? {};
  return { touches: count(all.touches), meanMm: number(all.mean_mm), maxMm: number(all.max_mm) };
}

function result(value: unknown): Result | null {
  const all = fields(value);
  if (!all) return null;
  const severities = ["withholds", "warns", "informs"] as const;
  return {
    publish: all.publish === true,
    scope: all.scope === "workspace" ? "workspace" : "near targets",
    findings: list(all.findings).map((one) => ({
      severity: severities.find((name) => name === fields(one)?.severity) ?? "informs",
      words: words(fields(one)?.words),
    })),
    before: summary(all.before), after: summary(all.after), check: summary(all.check),
    nearTargetsMm: number(all.near_targets_mm), workspaceMm: number(all.workspace_mm),
    nominalWorkspaceMm: number(all.nominal_workspace_mm), nominalWorkspaceUMm: number(all.nominal_workspace_u_mm),
  };
}

export function figures(value: unknown): Figures | null {
  const all = fields(value);
  if (!all) return null;
  const session = count(all.session);
  return {
    session, state: words(all.state), outcome: outcome(all.outcome),
    touches: known(list(all.touches).map((one) => touch(one, session))),
    result: result(all.result),
  };
}

function session_row(value: unknown): SessionRow | null {
  const all = fields(value);
  if (!all || number(all.id) === null) return null;
  return {
    id: count(all.id), kind: one_of(all.kind, KINDS) as Kind, started: words(all.started), ended: words(all.ended),
    state: one_of(all.state, STATES) as SessionState, cell: words(all.cell),
    touches: count(all.touches), planned: count(all.planned), failure: words(all.failure),
    outcome: outcome(all.outcome), published: truth(all.published),
  };
}
/** Newest first; a list, or pages with the list under "sessions". */
export const sessions = (value: unknown): SessionRow[] =>
  known(list(fields(value)?.sessions ?? value).map(session_row));

function drift_row(value: unknown): DriftRow | null {
  const all = fields(value);
  if (!all || number(all.session) === null) return null;
  const zeros = list(all.zeros).map((one) => {
    const zero = fields(one);
    const deg = number(zero?.deg);
    return zero && deg !== null
      ? { joint: words(zero.joint), deg, sigmaDeg: number(zero.sigma_deg) }
      : null;
  });
  return {
    session: count(all.session), ended: words(all.ended), publish: all.publish === true,
    fitMm: number(all.fit_mm), checkMm: number(all.check_mm),
    workspaceMm: number(all.workspace_mm), zeros: known(zeros),
  };
}
function drift_point(value: unknown): DriftPoint | null {
  const all = fields(value);
  const timeS = number(all?.time_s), state = DRIFT_STATES.find((one) => one === all?.state);
  if (!all || timeS === null || !state) return null;
  return {
    session: count(all.session), timeS, state, holds: truth(all.holds),
    leftOut: typeof all.left_out === "string" ? words(all.left_out) : null,
    offMm: point(all.off_mm), ewma: number(all.ewma) ?? 0, cusum: number(all.cusum) ?? 0, share: number(all.share) ?? 0,
    temperatureC: number(all.temperature_c),
  };
}
function other_chart(value: unknown): { calibration: number; points: DriftPoint[] } | null {
  const all = fields(value);
  return all && { calibration: count(all.calibration), points: known(list(all.points).map(drift_point)) };
}
function drift_event(value: unknown): DriftEvent | null {
  const all = fields(value);
  const timeS = number(all?.time_s);
  return all && timeS !== null ? { session: count(all.session), timeS, words: words(all.words) } : null;
}
function drift_trend(value: unknown): DriftTrend | null {
  const all = fields(value);
  const offMm = number(all?.off_mm), sinceS = number(all?.since_s);
  if (!all || offMm === null || sinceS === null) return null;
  const cause = fields(list(all.causes)[0]);
  return {
    shape: all.shape === "creep" ? "creep" : "step", since: count(all.since), sinceS, offMm,
    uOffMm: number(all.u_off_mm), mmPerMonth: number(all.mm_per_month), uMmPerMonth: number(all.u_mm_per_month),
    cause: CHANGES.find((one) => one === cause?.kind) ?? null, causeName: words(cause?.name),
    probability: number(cause?.probability) ?? 0,
  };
}
function not_held(value: unknown): DriftNotHeld | null {
  const all = fields(value);
  if (!all) return null;
  const cause = fields(all.cause);
  return {
    session: count(all.session), timeS: number(all.time_s) ?? 0, since: count(all.since), sinceS: number(all.since_s) ?? 0,
    shiftMm: number(all.tcp_shift_mm), uShiftMm: number(all.u_tcp_shift_mm),
    cause: CHANGES.find((one) => one === cause?.kind) ?? null, causeName: words(cause?.name),
    probability: number(cause?.probability) ?? 0,
  };
}
/** A limit of zero would make every share infinite. */
function control_limits(value: unknown): ControlLimits | null {
  const all = fields(value);
  const ewma = number(all?.ewma) ?? 0, cusum = number(all?.cusum) ?? 0;
  return ewma > 0 && cusum > 0 ? { ewma, cusum, runLength: count(all?.run_length) } : null;
}
function standing(value: unknown): Standing | null {
  const all = fields(value);
  const holds = HOLDINGS.find((one) => one === all?.holds);
  const evidenceS = number(all?.evidence_s), dueS = number(all?.due_s);
  return holds && evidenceS !== null ? { holds, byCheck: all?.by_check === true, evidenceS, dueS } : null;
}
function drift_chart(value: unknown): DriftChart | null {
  const all = fields(value);
  const state = DRIFT_STATES.find((one) => one === all?.state);
  const warns = control_limits(all?.warns), alarms = control_limits(all?.alarms);
  if (!all || !state || !warns || !alarms) return null;
  return {
    calibration: count(all.calibration), calibrated: words(all.calibrated), cell: words(all.cell),
    standing: standing(all.standing), state, advice: ADVICE.find((one) => one === all.advice) ?? "none",
    counted: count(all.counted), least: count(all.least),
    undecided: count(all.undecided), decidedS: number(all.decided_s) ?? 0, warns, alarms,
    trend: drift_trend(all.course), notHeld: not_held(all.not_held), points: known(list(all.points).map(drift_point)),
    others: known(list(all.others).map(other_chart)), events: known(list(all.events).map(drift_event)),
  };
}
/** A drawing cut off would be none. */
const drawing = (value: unknown): string => (typeof value === "string" && value.length <= MOST_DRAWN ? value : "");
export function plots(value: unknown): PlotsSeen | null {
  const all = fields(value);
  return all && { beforeAfter: drawing(all.before_after), byJoint: list(all.by_joint).map(drawing).filter((one) => one !== ""), errorMap: drawing(all.error_map) };
}
function advice_status(value: unknown): AdviceStatus | null {
  const all = fields(value);
  return all && { value: number(all.value), acknowledgedAt: words(all.told_at), trouble: words(all.trouble) };
}
export const drift = (value: unknown): DriftSeen => ({
  rows: known(list(fields(value)?.sessions).map(drift_row)), checks: drift_chart(fields(value)?.checks),
  controller: advice_status(fields(value)?.controller),
});

function version(value: unknown): Version | null {
  const all = fields(value);
  if (!all || number(all.session) === null) return null;
  const by = fields(all.activated);
  return {
    session: count(all.session), ended: words(all.ended), workspace: all.scope === "workspace",
    predictedMm: number(all.predicted_mm), u95Mm: number(all.u95_mm), active: all.active === true,
    trouble: words(all.trouble),
    activated: by ? { time: words(by.time), who: words(by.who), reason: words(by.reason) } : null,
  };
}
export const versions = (value: unknown): Version[] => known(list(value).map(version));
export function comparison(value: unknown): Comparison | null {
  const all = fields(value);
  if (!all) return null;
  return {
    meanMm: all.comparable === true ? number(all.mean_mm) : null, maxMm: number(all.max_mm),
    expectedMm: number(all.expected_mm), moved: list(all.moved).map((one) => words(fields(one)?.name)),
    onlyBefore: list(all.only_before).map(words), onlyAfter: list(all.only_after).map(words),
  };
}

function proposal(value: unknown): Proposal | null {
  const all = fields(value);
  const kind = PROPOSALS.find((one) => one === all?.kind);
  const stand = (["open", "accepted", "refused"] as const).find((one) => one === all?.stand);
  if (!all || !kind || !stand || words(all.id) === "") return null;
  return {
    id: words(all.id), kind, stand, session: number(all.session), text: words(all.text), by: words(all.by),
    reason: words(all.reason), received: words(all.received), file: words(all.file),
    decided: words(all.decided), decidedBy: words(all.decided_by),
  };
}
export function proposals(value: unknown): ProposalsSeen | null {
  const all = fields(value);
  return all ? { problem: words(all.problem), proposals: known(list(all.proposals).map(proposal)) } : null;
}

function step(value: unknown): StepSeen | null {
  const all = fields(value);
  const name = STEPS.find((one) => one === all?.step);
  const states = ["todo", "done", "wrong"] as const;
  const state = states.find((one) => one === all?.state);
  return all && name && state
    ? { step: name, state, words: words(all.words), session: number(all.session) } : null;
}
export function readiness(value: unknown): Readiness | null {
  const all = fields(value);
  if (!all || !Array.isArray(all.steps)) return null;
  return {
    cell: words(all.cell), robot: words(all.robot), spheres: count(all.spheres), placed: count(all.placed),
    next: STEPS.find((one) => one === all.next) ?? null, steps: known(list(all.steps).map(step)),
  };
}

export function schedule(value: unknown): Schedule | null {
  const all = fields(value);
  if (!all) return null;
  const begins = known(list(all.entries).map((one) => {
    const entry = fields(one);
    return entry?.on_request === true ? null : number((fields(entry?.now) ?? fields(entry?.next))?.begins_utc_s);
  }));
  return { unattended: all.unattended === true, held: words(all.held) !== "",
           nextS: begins.length > 0 ? Math.min(...begins) : null };
}

function finding(value: unknown): Finding | null {
  const all = fields(value);
  const outcomes = ["ok", "warning", "failed", "skipped"] as const;
  const outcome = outcomes.find((one) => one === all?.outcome);
  return all && outcome
    ? { check: words(all.check), known: CHECKS.find((one) => one === all.check) ?? null, outcome, found: words(all.found), advice: words(all.advice) } : null;
}
export function doctor(value: unknown): Doctor | null {
  const all = fields(value);
  if (!all || !Array.isArray(all.checks)) return null;
  return {
    cell: words(all.cell), running: all.running === true, hint: words(all.hint), ended: words(all.ended),
    green: all.green === true, checks: known(list(all.checks).map(finding)),
  };
}

/** Without a role the daemon reports nothing about the cell. */
export function role(value: unknown): Role | null {
  const given = fields(value)?.role;
  return given === "look" || given === "operate" || given === "administer" ? given : null;
}

export const error_words = (value: unknown): string => words(fields(value)?.error);
