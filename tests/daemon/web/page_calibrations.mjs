// Answers of the daemon about a calibration that would require weeks or a fault.

const HOUR_S = 3600;
export const DAY_S = 86400;

/** Answers of GET /v1/drift and /v1/versions for a valid current calibration. */
export function calibrated(standing, more = {}) {
  const now_s = Date.now() / 1000, calibrated_s = now_s - 20 * DAY_S;
  return {
    drift: { ...chart_of_months(), points: [], course: null, state: "in_control", advice: "none", calibration: 2, cell: process.env.CELL,
             calibrated: new Date(calibrated_s * 1000).toISOString(),
             standing: { holds: "holds", by_check: true, evidence_s: now_s - 2 * HOUR_S, due_s: now_s + 14 * DAY_S, ...standing }, ...more },
    versions: [{ session: 2, ended: "", scope: "workspace", predicted_mm: 0.08, u95_mm: 0.104, active: true, trouble: "", activated: null }],
  };
}
export const broken = () => calibrated({ holds: "does_not_hold" }, {
  state: "alarms", advice: "re_measure_tcp",
  not_held: { session: 9, time_s: Date.now() / 1000 - HOUR_S, since: 8, since_s: Date.now() / 1000 - DAY_S, checks: 2, tcp_shift_mm: 1.02,
              u_tcp_shift_mm: 0.05, cause: { kind: "tool", name: "torch", probability: 0.98, words: "" } },
});

/** Answer of GET /v1/drift: two stable months and one of creep, one check per shift. */
export function chart_of_months() {
  const began_s = Date.UTC(2026, 0, 5) / 1000;
  const points = Array.from({ length: 180 }, (_, k) => {
    const creep = 0.05 * Math.max(0, k - 46) / 90, scatter = 0.012 * Math.sin(12.9898 * k);
    const share = Math.abs(creep) / 0.04 + Math.abs(scatter) * 30;
    return { session: k, time_s: began_s + k * 28800, temperature_c: null, holds: true, left_out: k === 20 ? "undecided" : null,
             off_mm: k === 20 ? null : [creep + scatter, 0.01 * Math.cos(3.1 * k), 0.008 * Math.sin(5.7 * k)], u_mm: [0.04, 0.04, 0.04],
             ewma: 3.984 * share, cusum: 4 * share, share, state: share > 1 ? "alarms" : share > 0.8 ? "warns" : "in_control" };
  });
  return {
    format: "cellcal.drift/1", calibration: 2, calibrated: "2026-01-04T22:00:00.000Z", state: "alarms", advice: "re_measure_tcp",
    counted: 179, least: 5, warns: { ewma: 3.456, cusum: 4.059, run_length: 200 }, alarms: { ewma: 3.984, cusum: 5.091, run_length: 1000 },
    noise: 1, um_per_kelvin: null, alarmed_at: 110, points, words: [],
    course: { shape: "creep", since: 47, since_s: began_s + 46 * 28800, checks: 133, off_mm: 0.074, u_off_mm: 0.011, off_xyz_mm: [0.074, 0, 0],
              mm_per_month: 0.05, u_mm_per_month: 0.007, causes: [{ kind: "tool", name: "torch", probability: 0.97, words: "" }] },
    others: [{ calibration: 1, points: points.slice(0, 20).map((one, k) => ({ ...one, session: 1000 + k, time_s: began_s - (21 - k) * 28800 })) }],
    events: [
      { kind: "calibrated", session: 1, time_s: began_s - 22 * 28800, words: "calibration of session 1" },
      { kind: "updated", session: 2, time_s: began_s - 7200, words: "update of session 2: tool changed, TCP moved by 1.250 mm" },
    ],
  };
}
