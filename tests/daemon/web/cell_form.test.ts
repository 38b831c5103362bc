import assert from "node:assert/strict";
import { test } from "node:test";
import {
  cell_file, cell_forms, draft_of, EMPTY, form_answer, form_of, imported, length_drafts, name_within, new_obstacle, numbers_in, placed, places_wanted, refused_field,
  sketch_of, sphere_drafts, still_missing, taught_angles, unit_seen, vouch, type CellDraft,
} from "../src/cell_form";

const DKD = { certificate: "DKD-1", date: "2026-04-01" };
const DRAFT: CellDraft = {
  ...EMPTY, robot: "kr5_r1400", xyz: "59,9 50.5 410.3", mass: "1,5",
  spheres: [
    { id: "S1", diameter: "49,998", u: "0.001", place: "centre", where: "900 -300 400", rough: "10", serial: "77", ...DKD },
    { id: "S2", diameter: "50", u: "0.004", place: "taught", where: "0 -90 90 0 45 0", rough: "20", serial: "", ...DKD },
    { id: "S3", diameter: "50", u: "0.004", place: "box", where: "1000 -50 350; 1100 50 450", rough: "", serial: "", ...DKD },
  ],
  lengths: [{ from: "S1", to: "S2", mm: "600,012", u: "0.008", ...DKD }],
  ...DKD,
};

test("numbers have a space between them and either decimal mark", () => {
  assert.deepEqual(numbers_in(" 1,5  -2.25\t3 "), [1.5, -2.25, 3]);
  assert.deepEqual(numbers_in("1;2;3"), [1, 2, 3]);
  assert.deepEqual(numbers_in(""), []);
  for (const bad of ["1,2,3", "1e5", "x", "1 2 mm", "0x10", "Infinity", "--1", "1."]) assert.equal(numbers_in(bad), null, bad);
});

test("a cell that was typed is sent in the daemon's keys: one sigma of what is stated for k = 2", () => {
  const made = form_of(DRAFT);
  assert.ok("form" in made);
  const vouched = { certificate: "DKD-1", certificate_date: "2026-04-01" };
  assert.deepEqual(made.form, {
    robot: "kr5_r1400",
    tool: { xyz_mm: [59.9, 50.5, 410.3], abc_deg: [0, 0, 0], xyz_sigma_mm: [0.5, 0.5, 0.5], tip_radius_mm: 0, mass_kg: 1.5 },
    spheres: [
      { id: "S1", diameter_mm: 49.998, diameter_sigma_mm: 0.0005, centre_mm: [900, -300, 400], centre_sigma_mm: 5, serial: "77", ...vouched },
      { id: "S2", diameter_mm: 50, diameter_sigma_mm: 0.002, joints_deg: [0, -90, 90, 0, 45, 0], centre_sigma_mm: 10, ...vouched },
      { id: "S3", diameter_mm: 50, diameter_sigma_mm: 0.002, box_mm: [[1000, -50, 350], [1100, 50, 450]], ...vouched },
    ],
    lengths: [{ from: "S1", to: "S2", mm: 600.012, sigma_mm: 0.004, ...vouched }],
    obstacles: [],
  });
});

const OBSTACLES: CellDraft["obstacles"] = [
  { id: "table", shape: "box", size: "800 600 20,5", file: "", middle: "1000 0 90", turn: "30 0 0" },
  { id: "pillar", shape: "cylinder", size: "120 1500", file: "", middle: "0 1200 750", turn: "0 0 0" },
  { id: "fixture", shape: "mesh", size: "", file: "/s/cells/0a.mesh.stl", middle: "1000 0 100", turn: "0 0 0" },
];

test("the floor is sent as a number, shown as it was typed, and left out where it is not known", () => {
  const made = form_of({ ...DRAFT, floor: "-20,5" });
  assert.ok("form" in made);
  assert.equal((made.form as { floor_mm?: number }).floor_mm, -20.5);
  assert.equal(draft_of("weld", made.form)?.floor, "-20.5");
  const bad = form_of({ ...DRAFT, floor: "low" });
  assert.deepEqual("wrong" in bad && bad.wrong.map(({ at, field }) => [at, field]), [["tool.floor", "floor"]]);
  assert.equal(draft_of("weld", { tool: {} })?.floor, "");
});

test("obstacles and the load's centre are sent in the daemon's keys, and shown as they were typed", () => {
  const made = form_of({ ...DRAFT, com: "30 25,5 205", obstacles: OBSTACLES, spheres: [] });
  assert.ok("form" in made);
  const { tool, obstacles } = made.form as { tool: Record<string, unknown>; obstacles: unknown };
  assert.deepEqual(tool.com_mm, [30, 25.5, 205]);
  assert.deepEqual(obstacles, [
    { id: "table", shape: "box", size_mm: [800, 600, 20.5], xyz_mm: [1000, 0, 90], abc_deg: [30, 0, 0] },
    { id: "pillar", shape: "cylinder", diameter_mm: 120, height_mm: 1500, xyz_mm: [0, 1200, 750], abc_deg: [0, 0, 0] },
    { id: "fixture", shape: "mesh", file: "/s/cells/0a.mesh.stl", xyz_mm: [1000, 0, 100], abc_deg: [0, 0, 0] },
  ]);
  const again = draft_of("weld", made.form);
  assert.equal(again?.com, "30 25.5 205");
  assert.deepEqual(again?.obstacles.map((one) => [one.id, one.size, one.file, one.middle, one.turn]),
                   [["table", "800 600 20.5", "", "1000 0 90", "30 0 0"], ["pillar", "120 1500", "", "0 1200 750", "0 0 0"], ["fixture", "", "/s/cells/0a.mesh.stl", "1000 0 100", "0 0 0"]]);
});

test("the picture is drawn of what is complete, and of nothing before the robot is chosen", () => {
  assert.equal(sketch_of(EMPTY), null);
  const ids = (draft: CellDraft) => {
    const { spheres, obstacles, tool } = sketch_of(draft) as { spheres: { id: string }[]; obstacles: { id: string }[]; tool: { xyz_mm: number[] } };
    return [spheres.map((one) => one.id), obstacles.map((one) => one.id), tool.xyz_mm];
  };
  assert.deepEqual(ids({ ...EMPTY, robot: "kr5_r1400" }), [[], [], [0, 0, 0]]);
  const half = DRAFT.spheres.map((one, i) => ({ ...one, u: "", ...(i === 1 ? { where: "0 -90" } : {}) }));
  assert.deepEqual(ids({ ...DRAFT, spheres: [...half, half[0]!], obstacles: [...OBSTACLES, new_obstacle(4)] }),
                   [["S1", "S3"], ["table", "pillar", "fixture"], [59.9, 50.5, 410.3]], "a half typed place and a second S1 are left out");
});

test("places are proposed once all but the places is there, and put into the rows of their names", () => {
  const wanted = places_wanted({ ...DRAFT, spheres: DRAFT.spheres.map((one) => ({ ...one, u: "", where: "" })) });
  assert.ok("form" in wanted);
  const lacking = places_wanted(EMPTY);
  assert.ok("wrong" in lacking);
  assert.deepEqual(lacking.wrong.map((one) => one.at), ["tool.robot", "tool.xyz", ...[0, 1, 2, 3].map((i) => `spheres.${i}.diameter`)]);
  const spheres = placed(DRAFT, sphere_drafts([{ id: "S2", diameter_mm: 50, centre_mm: [860, -1090, 810], centre_sigma_mm: 10 }]));
  assert.deepEqual(spheres.map((one) => [one.place, one.where, one.rough]), [["centre", "900 -300 400", "10"], ["centre", "860 -1090 810", "20"], ["box", "1000 -50 350; 1100 50 450", ""]]);
  assert.equal(spheres[1]?.diameter, "50");
});

test("a cell file of another computer becomes a draft with a name, what is kept and what is missing", () => {
  const made = form_of(DRAFT);
  assert.ok("form" in made);
  const obstacles = ["fixture", "fence"].map((id) => ({ id, shape: "mesh", file: "", xyz_mm: [0, 0, 0] }));
  const seen = cell_file("Zelle 3 (neu).toml", { form: { ...(made.form as object), robot: "", obstacles }, kept: ["target plate"], missing: ["kr5_worn.toml", "a.stl", "b.stl"] });
  assert.ok(seen);
  assert.deepEqual([seen.draft.name, seen.kept], ["Zelle_3__neu_", ["target plate"]]);
  // Each is missing until it is chosen.
  const missing = (change: Partial<CellDraft>) => still_missing(seen.missing, { ...seen.draft, ...change }).map((one) => one.name);
  assert.deepEqual(missing({}), ["kr5_worn.toml", "a.stl", "b.stl"]);
  assert.deepEqual(missing({ robot: "kr5_r1400" }), ["a.stl", "b.stl"]);
  assert.deepEqual(missing({ obstacles: seen.draft.obstacles.map((one) => (one.id === "fence" ? { ...one, file: "/s/0a.mesh.stl" } : one)) }), ["kr5_worn.toml", "a.stl"]);
  assert.deepEqual(missing({ robot: "kr5_r1400", obstacles: [] }), []);
  for (const value of [null, {}, { form: 3 }]) assert.equal(cell_file("a.toml", value), null);
});

test("a sphere's uncertainty is that of its certificate: none is filled in", () => {
  assert.deepEqual(EMPTY.spheres.map((one) => one.u), ["", "", "", ""]);
});

test("what is wrong is named with its field, its row, and how many numbers it must hold", () => {
  const wrong = (change: Partial<CellDraft>) => {
    const made = form_of({ ...DRAFT, ...change });
    return "wrong" in made ? made.wrong.map(({ field, of, counts, positive, at }) => [at, field, of, counts.join("|"), positive]) : null;
  };
  assert.deepEqual(wrong({ robot: "" }), [["tool.robot", "robot", "", "", false]]);
  assert.deepEqual(wrong({ xyz: "1 2", mass: "heavy" }), [["tool.xyz", "xyz", "", "3", false], ["tool.mass", "mass", "", "1", false]], "all of them");
  const sphere = (change: object) => wrong({ spheres: DRAFT.spheres.map((one, i) => (i === 1 ? { ...one, ...change } : one)) });
  assert.deepEqual(sphere({ where: "1 2 3" }), [["spheres.1.where", "where", "S2", "6|7", false]]);
  assert.deepEqual(sphere({ diameter: "" }), [["spheres.1.diameter", "diameter", "S2", "1", true]]);
  assert.deepEqual(sphere({ diameter: "0" }), [["spheres.1.diameter", "diameter", "S2", "1", true]]);
  assert.deepEqual(wrong({ lengths: [{ from: "S1", to: "S2", mm: "x", u: "0.01", ...DKD }] }), [["lengths.0.mm", "mm", "S1–S2", "1", true]]);
  const obstacle = (change: object) => wrong({ obstacles: [{ ...OBSTACLES[0]!, ...change }] });
  assert.deepEqual(obstacle({}), null);
  assert.deepEqual(obstacle({ size: "800 -1 20" }), [["obstacles.0.size", "size", "table", "3", true]]);
  assert.deepEqual(obstacle({ shape: "cylinder" }), [["obstacles.0.size", "size", "table", "2", true]]);
  assert.deepEqual(obstacle({ shape: "mesh" }), [["obstacles.0.file", "file", "table", "", false]]);
  assert.deepEqual(obstacle({ middle: "", turn: "x" })?.map(([at]) => at), ["obstacles.0.middle", "obstacles.0.turn"]);
});

test("a cell that was made is shown as it was typed", () => {
  const made = form_of({ ...DRAFT, spheres: DRAFT.spheres.filter((one) => one.place !== "taught"), lengths: [] });
  assert.ok("form" in made);
  const draft = draft_of("weld", made.form);
  assert.ok(draft);
  const again = form_of(draft);
  assert.ok("form" in again);
  assert.deepEqual(again.form, made.form);
  assert.equal(draft.spheres[0]?.u, "0.001");
  assert.equal(draft.certificate, "DKD-1");
});

test("each sphere and distance keeps its own certificate, and none where it states none", () => {
  const form = {
    robot: "kr5_r1400", tool: { xyz_mm: [59.9, 50.5, 410.3] },
    spheres: [
      { id: "S1", diameter_mm: 50, centre_mm: [900, -300, 400] },
      { id: "S2", diameter_mm: 50, centre_mm: [900, 300, 400], certificate: "DKD-1", certificate_date: "2026-04-01" },
      { id: "S3", diameter_mm: 50, centre_mm: [1100, 0, 300], certificate: "PTB-9" },
    ],
    lengths: [{ from: "S1", to: "S2", mm: 600, sigma_mm: 0.004, certificate: "CMM-3" }],
  };
  const certificates = (draft: CellDraft | null) => {
    const made = draft && form_of(draft);
    assert.ok(made && "form" in made);
    const { spheres, lengths } = made.form as { spheres: { certificate?: string }[]; lengths: { certificate?: string }[] };
    return [...spheres, ...lengths].map((one) => one.certificate);
  };
  const draft = draft_of("weld", form);
  assert.deepEqual(certificates(draft), [undefined, "DKD-1", "PTB-9", "CMM-3"]);
  assert.ok(draft);
  assert.deepEqual(certificates(vouch(draft, { certificate: "DKD-2" })), [undefined, "DKD-2", "PTB-9", "CMM-3"], "only rows of that one follow");
  const emptied = vouch(draft, { certificate: "" }, draft);
  assert.deepEqual(certificates(vouch(emptied, { certificate: "DKD-3" }, draft)), [undefined, "DKD-3", "PTB-9", "CMM-3"], "emptied and typed anew");
  assert.deepEqual(certificates(imported(draft, { spheres: sphere_drafts(form.spheres) })), [undefined, "DKD-1", "PTB-9", "CMM-3"]);
});

test("a certificate that is typed first, or last, is that of each row that states none", () => {
  const typed = vouch(EMPTY, { certificate: "DKD-1" });
  assert.ok(typed.spheres.every((one) => one.certificate === "DKD-1"));
  const rows = length_drafts([{ from: "S1", to: "S2", mm: 600, sigma_mm: 0.004 }]);
  assert.equal(imported(typed, { lengths: rows }).lengths[0]?.certificate, "DKD-1");
  assert.equal(vouch(imported(EMPTY, { lengths: rows }), { certificate: "DKD-1" }).lengths[0]?.certificate, "DKD-1");
});

test("nothing of what arrives is believed", () => {
  for (const value of [null, 3, "x", [], {}, { tool: 3 }, { tool: {}, spheres: 3 }]) {
    draft_of("a", value);
    cell_forms(value);
    assert.deepEqual(sphere_drafts(value), []);
    assert.deepEqual(length_drafts(value), []);
  }
  const seen = cell_forms({ folder: "/var/lib/cellcal/cells", robots: [3, { name: "kr5", model: "KR 5" }], shown: { form: null, file: "f", sha256: "s", name: "n" } });
  assert.deepEqual(seen?.robots, [{ name: "kr5", model: "KR 5" }]);
  assert.equal(seen?.shown?.draft, null);
});

test("only a file of that folder has a name there", () => {
  assert.equal(name_within("/s/cells", "/s/cells/weld.toml"), "weld");
  for (const file of ["/s/cells/../x.toml", "/s/cells/a/b.toml", "/etc/cellcal/cell.toml", "", "/s/cells/weld.toml.before", "/s/cellsweld.toml"])
    assert.equal(name_within("/s/cells", file), "", file);
  assert.equal(name_within("", "/weld.toml"), "");
});

test("takes the angles that the robot says, and nothing that is none", () => {
  assert.equal(taught_angles({ axes_deg: [10, -80.12344, 95, -0.00001, 60, 170.5] }), "10 -80.1234 95 -0 60 170.5");
  assert.equal(taught_angles({ axes_deg: [1, 2, 3, 4, 5, 6, 7] })?.split(" ").length, 7);
  for (const wrong of [null, {}, { axes_deg: [] }, { axes_deg: [1, 2, 3] }, { axes_deg: [1, 2, 3, 4, 5, null] }, { axes_deg: "x" }])
    assert.equal(taught_angles(wrong), null);
});

test("the linear unit of an imported robot is read whole, or not at all", () => {
  const unit = { name: "E1", along: [0, 1, 0], min_mm: 0, max_mm: 3000, max_speed_mm_s: null };
  assert.deepEqual(unit_seen({ linear_unit: unit }), { missing: "", name: "E1", along: [0, 1, 0], min: 0, max: 3000, speed: null });
  assert.equal(unit_seen({ linear_unit: { ...unit, max_speed_mm_s: 1500 } })?.speed, 1500);
  assert.equal(unit_seen({ linear_unit: { missing: "$ET1_AX" } })?.missing, "$ET1_AX");
  for (const wrong of [null, {}, { linear_unit: true }, { linear_unit: { ...unit, along: [0, 1] } }, { linear_unit: { ...unit, along: [0, 1, "x"] } }, { linear_unit: { ...unit, min_mm: "0" } }])
    assert.equal(unit_seen(wrong), null);
});

test("a refusal of the daemon is about the field that states the value, or about none", () => {
  const at = (key: unknown, reason = "why") => refused_field({ error: "x", key, reason }, DRAFT)?.at;
  assert.equal(at("spheres.1.diameter_mm"), "spheres.1.diameter");
  assert.equal(at("spheres.2.box_mm"), "spheres.2.where");
  assert.equal(at("lengths.0.sigma_mm"), "lengths.0.u");
  assert.equal(at("tool.tip_radius_mm"), "tool.tip");
  assert.equal(at("robot"), "tool.robot");
  assert.equal(at("name"), "tool.name");
  assert.equal(refused_field({ key: "lengths.0.mm", reason: "why" }, DRAFT)?.of, "S1–S2");
  for (const other of ["spheres.9.diameter_mm", "spheres.x.diameter_mm", "spheres.-1.id", "lengths.5.mm", "spheres.0.constructor", "__proto__.0.id", "obstacles.0.id", "", 7, null])
    assert.equal(at(other), undefined, String(other));
  assert.equal(at("tool.xyz_mm", ""), undefined, "without a reason");
  assert.equal(refused_field(null, DRAFT), null);
});

test("the form of a cell that is there is never the empty one", () => {
  const answer = (status: number) => ({ status, value: null, words: "" });
  const empty = answer(200);
  for (const status of [404, 422]) assert.equal(form_answer(empty, answer(status)), empty);
  for (const of_cell of [200, 0, 503, 500, 403, 401, 429].map(answer)) assert.equal(form_answer(empty, of_cell), of_cell);
});
