// Data of the daemon used by the page: as the API describes them, read by decode.ts. Without a value: null, "" or 0 (api.mjs).

import type * as api from "../generated/api";

export type {
  AdviceStatus, Cause, Comparison, ContactLink, Doctor, DriftChart, DriftEvent, DriftPoint, FailureKind, Holding, Outcome, Phase, PlannedTouch,
  Point, Readiness, Result, RobotLink, Status, StepSeen, Summary, Version,
} from "../generated/api";
export type Kind = api.SessionKind;
export type SessionRow = api.SessionLine;
export type Touch = api.TouchEvent;
export type RobotPosture = api.RobotEvent;
export type DriftSeen = api.Drift;
export type DriftRow = api.DriftSession;
export type DriftNotHeld = api.NotHeld;
export type StepName = api.StepSeen["step"];
export type Finding = api.DoctorFinding;
export type Role = api.Me["role"];

/** 3x4, row-major. */
export type Frame = readonly number[];
/** Withdrawn ones are not shown. */
export type Proposal = api.Proposal & { kind: Exclude<api.ProposalKind, "withdraw" | "unknown"> };
export interface ProposalsSeen extends api.Proposals {
  proposals: Proposal[];
}

/** A shape that can be drawn. */
export type Solid = api.Shape & ({ shape: "box"; size_mm: api.Point } | { shape: "cylinder" } | { shape: "mesh" });
export interface Scene extends api.Scene {
  up: api.Point;
  stands: Solid[];
  obstacles: Solid[];
}
export interface Figures extends api.Figures {
  touches: Touch[];
}
