// What the page takes from the daemon's answers, made of the API's own description: node api.mjs OPENAPI.json... OUT.ts.
// For each schema of an answer OUT.ts has a type, and a value of the same name by which src/read.ts checks what arrives.
//
// Wrong or missing values never throw. Of a number, object or list of fixed length null remains, of a text "", of a count 0, of
// a truth value false, of other lists nothing; and of a word that is not listed "unknown". An object without what it needs is
// nothing itself, and is left out of its list.

import openapiTS, { astToString } from "openapi-typescript";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname } from "node:path";

/** Without these (texts: not empty) an object is of no use. */
const NEEDS = {
  Status: ["seq", "phase"], TouchEvent: ["index"], FiguresTouch: ["index"], PlannedTouch: ["index", "tip_mm"],
  RobotEvent: ["joints_deg"], SessionLine: ["id"], Version: ["session"], Me: ["role"],
  Scene: ["base", "joints", "flange", "tool"], SceneJoint: ["behind", "sign"], SceneAxis: ["frame", "sign"], SceneTool: ["frame"],
  SceneTarget: ["id"], Shape: ["frame"],
  Outcome: ["kind"], OutcomeChange: ["kind", "value", "u"], FoundSphere: ["centre_mm"], TcpShift: ["length"],
  DriftChart: ["state", "warns", "alarms"], ControlLimits: ["ewma", "cusum", "run_length"], Standing: ["holds", "evidence_s"],
  DriftPoint: ["time_s", "ewma", "cusum", "share", "state"], DriftEvent: ["time_s"], DriftCourse: ["since_s", "off_mm"],
  NotHeld: ["time_s", "since_s"], DriftZero: ["deg"], DriftSession: ["session"],
  Readiness: ["steps"], StepSeen: ["step", "state"], Doctor: ["checks"], DoctorFinding: ["outcome"],
  FleetCells: ["cells"], FleetCell: ["plant", "cell"], FleetCalibration: ["session"], FleetCheck: ["held"], FleetSession: ["session"],
  Corrections: ["corrections"], Correction: ["correction", "sigma"],
  Proposal: ["id", "kind", "stand"], ScheduleSeen: ["open"],
};
/** What a word that is not listed is read as; with "unknown" also where the word is needed. */
const OTHERWISE = { Phase: "unknown", FailureKind: "unknown", Advice: "none", Severity: "informs", Scope: "near targets", TouchSet: "fit" };
/** Any other word is kept. */
const OPEN = ["Check"];
/** Their counts and truth values may be unknown (null). */
const UNCERTAIN = ["RobotLink", "ContactLink"];
/** Besides the answers: events of /v1/events. */
const EVENTS = ["TouchEvent", "RobotEvent"];

const files = process.argv.slice(2), out = files.pop();
const documents = files.map((file) => JSON.parse(readFileSync(file, "utf8")));
const schemas = {};
for (const [name, schema] of documents.flatMap((one) => Object.entries(one.components.schemas))) {
  if (name in schemas) throw new Error(`two schemas are named ${name}`);
  schemas[name] = schema;
}
for (const name of [...Object.keys(NEEDS), ...Object.keys(OTHERWISE), ...OPEN, ...UNCERTAIN, ...EVENTS])
  if (!(name in schemas)) throw new Error(`no schema is named ${name}`);

const name_in = (ref) => ref.split("/").pop();
const is_null = (schema) => schema.type === "null";

/** As the page reads it: everything is there, and what may be missing is null. Null: the page does not read it. */
function view(schema, { needed = false, uncertain = false, item = false } = {}) {
  const { description } = schema;
  const with_null = (one) => ({ ...(description && { description }), anyOf: [one, { type: "null" }] });
  const or_null = (one) => (needed || item ? one : with_null(one));
  if (schema.oneOf) {
    const others = schema.oneOf.filter((one) => !is_null(one));
    const one = others.length === 1 && schema.oneOf.length === 2 ? view(others[0], { needed: true }) : null;
    return one && with_null(one);
  }
  if (schema.$ref) {
    const name = name_in(schema.$ref), of = schemas[name];
    if (of.enum && (needed || item) && OTHERWISE[name] !== "unknown") return view(of, { needed, item });
    return of.enum || !fails(of, name) ? { ...(description && { description }), $ref: schema.$ref } : or_null({ $ref: schema.$ref });
  }
  if (Array.isArray(schema.type) && schema.type.includes("null")) {
    const type = schema.type.filter((one) => one !== "null");
    if (type.length !== 1) return null;
    const one = { ...schema, type: type[0], ...(schema.enum && { enum: schema.enum.filter((word) => word !== null) }) };
    if (one.type === "string" && !one.enum) return view(one);
    if (item) return view(one, { item }); // of lists of numbers, which are whole or nothing
    const inner = one.type === "string" && !needed ? otherwise(one.enum, "unknown") : view(one, { needed: true });
    return inner && (needed ? inner : with_null(inner));
  }
  const { type } = schema;
  if (schema.enum && type !== "integer") {
    const words = schema.enum;
    return needed || item ? { ...(description && { description }), type: "string", enum: words } : otherwise(words, "unknown");
  }
  if (type === "string") return { ...(description && { description }), type };
  if (type === "number") return or_null({ type, ...(description && { description }) });
  if (type === "integer") {
    const one = { type, ...(schema.enum && { enum: schema.enum }), ...("minimum" in schema && { minimum: schema.minimum }) };
    return uncertain || schema.enum ? or_null(one) : one;
  }
  if (type === "boolean") return uncertain ? or_null({ type }) : { type };
  if (type === "array") {
    const items = view(schema.items, { item: true });
    if (!items) return null;
    const one = { type, items };
    for (const bound of ["minItems", "maxItems"]) if (bound in schema) one[bound] = schema[bound];
    return fails(schema) ? or_null(one) : one;
  }
  const of_object = type === "object" && schema.properties ? object(schema, "") : null;
  return of_object && of_object.required.length > 0 ? or_null(of_object) : null;
}
const otherwise = (words, other) => ({ type: "string", enum: [...new Set([...words, other])], words, other });

/** Whether reading can end with nothing. */
function fails(schema, name = "") {
  if (schema.$ref) return fails(schemas[name_in(schema.$ref)], name_in(schema.$ref));
  return schema.type === "array" ? "minItems" in schema : (NEEDS[name] ?? []).length > 0;
}

function object(schema, name) {
  const properties = {};
  for (const [key, one] of Object.entries(schema.properties)) {
    const seen = view(one, { needed: NEEDS[name]?.includes(key), uncertain: UNCERTAIN.includes(name) });
    if (seen) properties[key] = seen;
  }
  for (const key of NEEDS[name] ?? []) if (!(key in properties)) throw new Error(`${name} has no ${key}`);
  return { type: "object", properties, required: Object.keys(properties), needs: NEEDS[name] };
}

function component(name) {
  const schema = schemas[name];
  if (OPEN.includes(name)) return { type: "string", words: schema.enum, open: true };
  if (schema.enum) return otherwise(schema.enum, OTHERWISE[name] ?? "unknown");
  return schema.properties ? object(schema, name) : view(schema, { needed: true });
}

/** The rule by which src/read.ts reads it. */
function rule(seen) {
  if (seen.$ref) return name_in(seen.$ref);
  if (seen.anyOf) return `{ or_null: ${rule(seen.anyOf[0])} }`;
  const { type, words = seen.enum, other, minimum, minItems, maxItems, needs, items, properties } = seen;
  const bounds = { least: minItems, most: maxItems, minimum }, parts = [`type: "${type}"`];
  if (words) parts.push(`words: ${JSON.stringify(words)}`);
  if (seen.open) parts.push("open: true");
  if (other) parts.push(`other: ${JSON.stringify(other)}`);
  for (const [key, bound] of Object.entries(bounds)) if (bound !== undefined) parts.push(`${key}: ${bound}`);
  if (needs) parts.push(`needs: ${JSON.stringify(needs)}`);
  if (items) parts.push(`items: ${rule(items)}`);
  if (properties) parts.push(`properties: { ${Object.entries(properties).map(([key, one]) => `${JSON.stringify(key)}: ${rule(one)}`).join(", ")} }`);
  return `{ ${parts.join(", ")} }`;
}

const views = new Map(); // in the order of use
function take(name) {
  if (views.has(name)) return;
  const seen = component(name);
  for (const [, used] of JSON.stringify(seen).matchAll(/"#\/components\/schemas\/(\w+)"/g)) take(used);
  views.set(name, seen);
}
const referred = (schema) => (schema?.$ref ? [name_in(schema.$ref)] : schema?.items ? referred(schema.items) : []);
for (const { paths } of documents)
  for (const operation of Object.values(paths).flatMap((one) => Object.values(one)))
    for (const answer of Object.values(operation.responses))
      referred(answer.content?.["application/json"]?.schema).filter((name) => schemas[name].properties).forEach(take);
[...EVENTS, ...Object.keys(schemas).filter((name) => schemas[name].enum)].forEach(take);

const plain = JSON.parse(JSON.stringify(Object.fromEntries(views)), (key, value) => (["words", "open", "other", "needs"].includes(key) && !value?.type && !value?.anyOf ? undefined : value));
const types = await openapiTS(
  { openapi: "3.1.0", info: { title: "", version: "" }, paths: {}, components: { schemas: plain } }, { arrayLength: true, silent: true });
const all = [...views].map(([name, seen]) =>
  `export type ${name} = components["schemas"]["${name}"];\nexport const ${name}: Rule<${name}> = ${rule(seen)};\n`);
mkdirSync(dirname(out), { recursive: true });
writeFileSync(out, `// Made by daemon/web/api.mjs.\nimport type { Rule } from "../src/read";\n${astToString(types)}\n${all.join("")}`);
