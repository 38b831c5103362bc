import assert from "node:assert/strict";
import { test } from "node:test";
import {
  cell_forms, draft_of, EMPTY, form_of, imported, length_drafts, name_within, numbers_in, sphere_drafts, taught_angles, vouch, type CellDraft,
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
  });
});

test("a sphere's uncertainty is that of its certificate: none is filled in", () => {
  assert.deepEqual(EMPTY.spheres.map((one) => one.u), ["", "", "", ""]);
});

test("what is wrong is named with its field, its sphere, and how many numbers it must hold", () => {
  const wrong = (change: Partial<CellDraft>) => {
    const made = form_of({ ...DRAFT, ...change });
    return "wrong" in made ? made.wrong : null;
  };
  assert.deepEqual(wrong({ robot: "" }), { field: "robot", of: "", counts: [] });
  assert.deepEqual(wrong({ xyz: "1 2" }), { field: "xyz", of: "", counts: [3] });
  assert.deepEqual(wrong({ mass: "heavy" }), { field: "mass", of: "", counts: [1] });
  const sphere = (change: object) => wrong({ spheres: DRAFT.spheres.map((one, i) => (i === 1 ? { ...one, ...change } : one)) });
  assert.deepEqual(sphere({ where: "1 2 3" }), { field: "where", of: "S2", counts: [6, 7] });
  assert.deepEqual(sphere({ diameter: "" }), { field: "diameter", of: "S2", counts: [1] });
  assert.deepEqual(wrong({ lengths: [{ from: "S1", to: "S2", mm: "x", u: "0", ...DKD }] }), { field: "mm", of: "S1–S2", counts: [1] });
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
