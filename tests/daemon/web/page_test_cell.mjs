// The real cellcald on a cell in its own process, for tests of the page in a browser.

import { execFile, spawn } from "node:child_process";
import { mkdtempSync, openSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";

const pause = (ms) => new Promise((done) => setTimeout(done, ms));

const free_port = () =>
  new Promise((done) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => done(port));
    });
  });

export class Cell {
  constructor() {
    this.folder = mkdtempSync(join(tmpdir(), "cellcal-page-"));
  }

  async begin() {
    this.port ??= await free_port();
    this.url = `http://127.0.0.1:${this.port}`;
    writeFileSync(join(this.folder, "cellcald.toml"), `
format = "cellcal.daemon/1"
backend = "mock"
state_dir = "${this.folder}/state"
socket = "${this.folder}/cellcald.sock"
[http]
listen = "127.0.0.1:${this.port}"
cell_folders = ["${dirname(process.env.CELL ?? "/none/cell.toml")}", "/none"]  # that one is not there
[motion]
speed_percent = 80
acceleration_deg_s2 = 600
jerk_deg_s3 = 8000
[rsi]
correction_limit_deg = 360
[mock]
seed = 12
deflection = 0.002
joint_noise_deg = 0.001
${this.mock ?? ""}
`);
    this.daemon = spawn(process.env.CELLCALD, ["--config", join(this.folder, "cellcald.toml")],
                        { stdio: ["ignore", "ignore", openSync(join(this.folder, "log"), "a")] });
    for (let i = 0; (await this.client("status").catch(() => null)) === null; ++i) {
      if (i === 200) throw new Error("cellcald does not answer");
      await pause(50);
    }
    this.token ??= (await this.client("token", "add", "--role", "operate", "--name", "test")).trim();
  }

  /** `cellcal`; a withheld result (3) is a result. */
  client_offline(...args) {
    return new Promise((done, failed) =>
      execFile(process.env.CELLCAL, args,
               (error, out, words) => (error && error.code !== 3 ? failed(new Error(words)) : done(out))));
  }
  client = (...args) => this.client_offline(...args, "--socket", join(this.folder, "cellcald.sock"));

  status = async () => JSON.parse(await this.client("status", "--json"));

  /** Like a power cut. */
  async kill() {
    const ended = new Promise((done) => this.daemon.once("exit", done));
    this.daemon.kill("SIGKILL");
    await ended;
  }

  async end() {
    const ended = new Promise((done) => this.daemon.once("exit", done));
    if (this.daemon.exitCode === null && this.daemon.signalCode === null) {
      this.daemon.kill("SIGTERM");
      await ended;
    }
    rmSync(this.folder, { recursive: true, force: true });
  }

  read = (file) => readFileSync(join(this.folder, file), "utf8");
}
