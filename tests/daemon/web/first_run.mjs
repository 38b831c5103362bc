// From an empty state directory to a published calibration on the emulated cell, by clicks and typing on the page alone; served by
// the real cellcald. Pictures are stored in screenshots/first-run-*. Skipped (77) without a browser.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { accessible, find_browser, is_in_reach, launch, LONG, say_steps, sees } from "./page_browser.mjs";
import { Cell } from "./page_test_cell.mjs";

const executablePath = find_browser();
const cell = new Cell();
const browser = await launch(executablePath);

/** ASCII STL of a square plate of 200 mm. */
const facet = (corners) => `facet normal 0 0 1\nouter loop\n${corners.map((one) => `vertex ${one}\n`).join("")}endloop\nendfacet\n`;
const PLATE = `solid plate\n${facet(["-100 -100 0", "100 -100 0", "100 100 0"])}${facet(["-100 -100 0", "100 100 0", "-100 100 0"])}endsolid plate\n`;
const file = (name, text) => ({ name, mimeType: "application/octet-stream", buffer: Buffer.from(text) });

/** The page has one primary button outside of dialogs; `name`: its text. */
async function first_button(page, name) {
  const visible = () => page.locator("main button.go:visible").allInnerTexts();
  for (let k = 0; k < 100; ++k) {
    const now = await visible();
    if (now.length === 1 && name.test(now[0])) return page.locator("main button.go:visible");
    await page.waitForTimeout(100);
  }
  throw new assert.AssertionError({ message: `not one first button ${name} but: ${(await visible()).join(", ")}` });
}

/** Starts the session that the page offers, and follows it to its end. */
async function session(page, name, id) {
  await (await first_button(page, name)).click();
  const go = page.getByRole("button", { name: "Start: the arm moves" });
  assert.ok(await go.isDisabled(), "nothing starts before the cell is said to be clear");
  assert.ok(await is_in_reach(page), "the dialog must not cover the button that stops the arm");
  await page.getByLabel("The cell is clear").check();
  await go.click();
  await sees(page, new RegExp(`Session ${id} is done`));
}

const steps = {
  async "meets the empty page: one button leads on"() {
    const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, locale: "en-GB" });
    this.page = await context.newPage();
    await this.page.goto(cell.url);
    await this.page.getByLabel("Token").fill(cell.token);
    await this.page.getByRole("button", { name: "Sign in" }).click();
    await this.page.getByText("Not calibrated: accuracy unknown, nothing published yet").waitFor(LONG);
    await (await first_button(this.page, /^Enter the cell here$/)).click();
    this.form = this.page.locator("dialog");
    await this.form.getByRole("heading", { name: "The cell: robot, tool, spheres, obstacles" }).waitFor(LONG);
  },

  async "shows errors at their fields"() {
    const { page, form } = this;
    await form.locator('[name="cell-robot"]').selectOption("kr5_r1400");
    await form.getByLabel("TCP: X Y Z").fill("59,9 50,5");
    await form.getByLabel("TCP: A B C").fill("38.84 3.59 0");
    await form.getByLabel("Mass on the flange").fill("1,535");
    await form.getByLabel("Centre of mass").fill("30 25 205");
    for (const row of await form.locator("[data-sphere]").all()) {
      await row.getByLabel("Diameter").fill("50");
      await row.getByLabel("U (k = 2)").fill("0,002");
      await row.getByLabel("Serial number").fill("77");
    }
    await form.getByRole("button", { name: "Propose places" }).click();
    const xyz = form.getByLabel("TCP: X Y Z");
    await form.locator('[id="wrong-tool.xyz"]').getByText("3 number(s)").waitFor(LONG);
    assert.equal(await xyz.getAttribute("aria-invalid"), "true");
    await page.waitForFunction(() => document.activeElement?.getAttribute("name") === "cell-xyz");
    await xyz.fill("59,9 50,5 410,3");
    await form.locator('[id="wrong-tool.xyz"]').waitFor({ ...LONG, state: "detached" });
  },

  async "keeps what is typed while the daemon does not answer"() {
    const { page, form } = this;
    await page.context().setOffline(true);
    await page.locator(".lost").first().waitFor(LONG);
    assert.equal(await form.getByLabel("TCP: X Y Z").inputValue(), "59,9 50,5 410,3");
    await page.context().setOffline(false);
    await page.locator(".lost").first().waitFor({ ...LONG, state: "detached" });
    assert.equal(await form.getByLabel("TCP: X Y Z").inputValue(), "59,9 50,5 410,3");
  },

  async "draws the obstacles as they are typed, and refuses what is no STL file"() {
    const { page, form } = this;
    const drawn = (obstacles) => form.locator(`.canvas[data-obstacles="${obstacles}"] canvas`).waitFor(LONG);
    await drawn(0);
    await form.getByRole("button", { name: "Add an obstacle" }).click();
    const table = form.locator('[data-obstacle="obstacle 1"]');
    await table.getByLabel("Size X Y Z").fill("600 400 20,5");
    await page.context().setOffline(true);
    const lost = page.waitForEvent("requestfailed", { ...LONG, predicate: (one) => one.url().endsWith("/v1/cell-form/scene") });
    await table.getByLabel("Middle X Y Z").fill("-900 0 10");
    await lost;
    await page.context().setOffline(false);
    await drawn(1);
    await form.getByRole("button", { name: "Add an obstacle" }).click();
    const pillar = form.locator('[data-obstacle="obstacle 2"]');
    await pillar.locator('[name="obstacle-shape"]').selectOption("cylinder");
    await pillar.getByLabel("Diameter and height").fill("120 1500");
    await pillar.getByLabel("Middle X Y Z").fill("-900 900 750");
    await drawn(2);
    await form.getByRole("button", { name: "Add an obstacle" }).click();
    const plate = form.locator('[data-obstacle="obstacle 3"]');
    await plate.locator('[name="obstacle-shape"]').selectOption("mesh");
    await plate.getByLabel("Origin of the file").fill("-900 -900 300");
    await plate.locator('[name="csv-mesh"]').setInputFiles(file("plate.stl", "<html>no mesh</html>"));
    await form.getByText("plate.stl: STL").waitFor(LONG);
    await plate.locator('[name="csv-mesh"]').setInputFiles(file("plate.stl", PLATE));
    await plate.getByLabel(/^STL file: [0-9a-f]{8}\.mesh\.stl/).waitFor(LONG);
    await drawn(3);
    await page.waitForFunction(() => document.querySelector("dialog .refused") === null);
  },

  async "places the spheres where it is proposed, and shows them"() {
    const { page, form } = this;
    await form.getByRole("button", { name: "Propose places" }).click();
    await form.getByText(/Predicted mean error \d\.\d+.mm, u95 \d\.\d+.mm, after 100 touches/).waitFor({ timeout: 120_000 });
    const where = await form.locator('[name="sphere-where"]').evaluateAll((all) => all.map((one) => one.value.split(" ").map(Number)));
    assert.equal(where.length, 4);
    assert.ok(where.every((one) => one.length === 3 && one.every((mm) => mm % 10 === 0)), `${where}`);
    await form.locator('.canvas[data-spheres="4"][data-obstacles="3"]').waitFor(LONG);
    await form.getByRole("button", { name: "Back to the places before" }).click();
    assert.equal(await form.locator('[name="sphere-where"]').first().inputValue(), "");
    await form.locator('.canvas[data-spheres="0"]').waitFor(LONG);
    // The spheres of the emulated cell are reachable from above.
    const there = [[1080, -320, 330], [1060, 380, 330], [640, -620, 640], [760, 560, 780]];
    for (const [i, xyz] of there.entries()) await form.locator('[name="sphere-where"]').nth(i).fill(xyz.join(" "));
    await form.locator('.canvas[data-spheres="4"]').waitFor(LONG);
    for (const [from, to] of [[0, 1], [0, 2], [1, 3], [2, 3]]) {
      await form.getByRole("button", { name: "Add a distance" }).click();
      const row = form.locator("[data-length]").last();
      await row.locator('[name="length-from"]').selectOption(`S${from + 1}`);
      await row.locator('[name="length-to"]').selectOption(`S${to + 1}`);
      await row.getByLabel("Distance").fill(Math.hypot(...there[from].map((mm, k) => mm - there[to][k])).toFixed(4));
      await row.getByLabel("U (k = 2)").fill("0.01");
    }
    await form.getByLabel("Certificate number").fill("DKD-1");
    await accessible(page, "the cell's form");
    for (const [width, height] of [[390, 844], [1920, 1080], [1280, 800]]) {
      await page.setViewportSize({ width, height });
      await page.waitForFunction(() => document.documentElement.scrollWidth <= innerWidth, null, { timeout: 5000 })
        .catch(() => assert.fail(`the form is wider than ${width} px`));
      assert.ok(await is_in_reach(page), `abort is covered at ${width}`);
      await page.screenshot({ path: `screenshots/first-run-form-${width}.png` });
    }
  },

  async "writes the cell and lets the doctor look at it"() {
    const { page, form } = this;
    await form.getByRole("button", { name: "Write and run the doctor" }).click();
    await form.waitFor({ ...LONG, state: "detached" });
    await page.locator('.guide [data-step="doctor"][data-state="done"]').waitFor(LONG);
    await first_button(page, /^Qualify$/);
    await page.screenshot({ path: "screenshots/first-run-qualify.png" });
  },

  async "opens a cell file made elsewhere, with all that the form does not show"() {
    const { page, form } = this;
    const elsewhere = cell.read("state/cells/cell.toml").replace('robot = "kr5_r1400"', 'robot = "kr5_worn.toml"')
      + '[[target]]\nid = "plate"\nkind = "plane"\ncentre_mm = [1200, 0, 300]\nnormal = [0, 0, 1]\n';
    await page.getByRole("button", { name: "Enter or change the cell here" }).click();
    const open = form.getByLabel("Open a cell file made elsewhere");
    await open.setInputFiles(file("hall-3.toml", elsewhere.replace(/diameter_mm = 50(\.0)?/, "diameter_mm = nan")));
    await form.getByText(/cell file:\d+: .*diameter_mm/).waitFor(LONG);
    await open.setInputFiles(file("hall-3.toml", elsewhere));
    await form.getByText(/Not on this computer, choose here: kr5_worn\.toml, .*\.mesh\.stl/).waitFor(LONG);
    await form.getByText("Not shown here, kept in the file: target plate").waitFor(LONG);
    assert.equal(await form.getByLabel("Name of the file").inputValue(), "hall-3");
    assert.equal(await form.locator('[name="sphere-where"]').nth(1).inputValue(), "1060 380 330");
    await form.locator('[name="cell-robot"]').selectOption("kr5_r1400");
    await form.getByText(/Not on this computer, choose here: [^,]*\.mesh\.stl\.$/).waitFor(LONG);
    await page.keyboard.press("Escape");
    await form.getByRole("button", { name: "Discard" }).click();
  },

  async "takes the linear unit of machine data into the cell, with the speed that they lack"() {
    const { page, form } = this;
    await page.getByRole("button", { name: "Enter or change the cell here" }).click();
    const machine = readFileSync(process.env.MACHINE_DATA, "latin1")
      + [1, 2, 3, 4, 5, 6].map((axis) => `\n$RAT_MOT_AX[${axis}]={N 100,D 1}`).join("")
      + "\n$EX_AX_NUM=1\n$AXIS_TYPE[7]=1\n$SOFTN_END[7]=0.0\n$SOFTP_END[7]=3000.0\n$EX_KIN={ET1 #ERSYS,ET2 #NONE}";
    const described = "\n$ET1_AX={TR_A1 #E1,TR_A2 #NONE,TR_A3 #NONE}\n$ET1_TA1KR={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C -90.0}"
      + "\n$ET1_TFLA3={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 90.0}\n";
    const robot = form.getByLabel("Robot not in the list");
    await robot.setInputFiles(file("machine.dat", machine));
    await form.getByText(/A linear unit carries the arm.*\$ET1_AX/).waitFor(LONG);
    await robot.setInputFiles(file("machine.dat", machine + described));
    await form.getByText("E1 carries the arm, 0 to 3000 mm along X 0, Y 1, Z 0 of its base").waitFor(LONG);
    await form.getByRole("button", { name: "Write and run the doctor" }).click();
    await form.getByText("State the highest speed of the linear unit and take it over").waitFor(LONG);
    await form.locator(".unit").scrollIntoViewIfNeeded();
    await page.screenshot({ path: "screenshots/first-run-linear-unit.png" });
    await form.getByLabel("Highest speed of the linear unit").fill("1500");
    await form.getByRole("button", { name: "Take it over" }).click();
    await form.getByText(/E1 carries the arm.* at 1500 mm\/s at most/).waitFor(LONG);
    await page.keyboard.press("Escape");
    await form.getByRole("button", { name: "Discard" }).click();
  },

  async "leads through qualification, dry run and first session to the published calibration"() {
    const { page } = this;
    await session(page, /^Qualify$/, 1);
    await session(page, /^Dry run$/, 2);
    await session(page, /^First session$/, 3);
    await session(page, /^Calibrate$/, 4);
    await page.locator('.standing[data-standing="holds"]').getByText(/emulated cell holds: TCP ±0\.\d+.mm \(95 %\), not checked yet/).waitFor(LONG);
    await page.locator(".versions tbody").getByText("in use").waitFor(LONG);
    await page.locator(".guide").waitFor({ ...LONG, state: "detached" });
    await page.screenshot({ path: "screenshots/first-run-calibrated.png" });
    await accessible(page, "calibrated");
  },
};

await cell.begin();
process.exit(await say_steps(steps, { cell, browser }) ? 0 : 1);
