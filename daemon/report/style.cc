// One style sheet for light and dark themes and print. Colours after Okabe and Ito, distinguishable with
// colour vision deficiency; kinds of touches differ in shape as well. One accent (blue), one alarm
// (vermilion).

#include "daemon/report/report.h"

namespace cellcal::daemon::report {

const char* style_sheet() {
  return R"css(
:root {
  color-scheme: light dark;
  --paper: #ffffff; --ink: #1b1f24; --soft: #57606a; --line: #d5dae0; --wash: #f4f6f8;
  --accent: #0a5fa8; --accent-wash: #e8f1fa; --alarm: #b84300; --alarm-wash: #fdefe6;
  --before: #8fb8dc; --band: #e8f1fa; --shade: rgb(0 0 0 / 0.22);
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14171b; --ink: #e6e9ed; --soft: #9aa4af; --line: #333a42; --wash: #1c2127;
    --accent: #6cb4f0; --accent-wash: #15283a; --alarm: #ff9457; --alarm-wash: #37200f;
    --before: #3d6a92; --band: #1a2a3a; --shade: rgb(0 0 0 / 0.75);
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "Liberation Sans",
    Arial, sans-serif;
  overflow-wrap: anywhere;
}
main { max-width: 1000px; margin: 0 auto; padding: 28px 24px 64px; }
p { max-width: 76ch; margin: 0 0 10px; }
h1 { font-size: 25px; line-height: 1.2; margin: 0 0 6px; font-weight: 650; }
h2 { font-size: 18px; line-height: 1.3; margin: 0 0 12px; font-weight: 650; }
h3 { font-size: 14px; margin: 18px 0 6px; font-weight: 650; }
section { margin-top: 32px; padding-top: 16px; border-top: 1px solid var(--line); }
ul, ol { margin: 0 0 10px; padding-left: 22px; max-width: 76ch; }
li { margin: 3px 0; }
small { font-size: 12.5px; color: var(--soft); }
code { font: 0.9em/1.4 ui-monospace, SFMono-Regular, Menlo, Consolas, "Liberation Mono", monospace; }
.facts { display: flex; flex-wrap: wrap; gap: 2px 22px; color: var(--soft); max-width: none; }
.facts b { color: var(--ink); font-weight: 550; }
.verdict {
  display: flex; gap: 16px; margin: 18px 0; padding: 16px 18px; border-radius: 6px;
  border-left: 6px solid var(--accent); background: var(--accent-wash);
}
.verdict.no { border-left-color: var(--alarm); background: var(--alarm-wash); }
.verdict .glyph {
  flex: none; width: 34px; height: 34px; border-radius: 50%; background: var(--accent);
  color: var(--paper); font-size: 19px; line-height: 34px; text-align: center;
}
.verdict.no .glyph { background: var(--alarm); }
.verdict p, .verdict ul { margin-bottom: 4px; }
.verdict .headline { font-size: 21px; font-weight: 650; line-height: 1.3; }
.verdict .because { font-weight: 600; margin-top: 10px; }
.lead { font-size: 16px; line-height: 1.55; max-width: 84ch; }
.note { font-size: 13.5px; color: var(--soft); margin-top: 8px; }
.note strong { color: var(--ink); font-weight: 600; }
.warn { color: var(--alarm); font-weight: 600; }
/* A shadow at the edge behind which there is more. */
.scroll {
  overflow-x: auto; background-color: var(--paper);
  background-image: linear-gradient(to right, var(--paper) 40%, transparent),
    linear-gradient(to left, var(--paper) 40%, transparent),
    linear-gradient(to right, var(--shade), transparent),
    linear-gradient(to left, var(--shade), transparent);
  background-position: 0 0, 100% 0, 0 0, 100% 0; background-repeat: no-repeat;
  background-size: 30px 100%, 30px 100%, 11px 100%, 11px 100%;
  background-attachment: local, local, scroll, scroll;
}
table { border-collapse: collapse; font-variant-numeric: tabular-nums lining-nums; }
th, td { padding: 4px 10px; text-align: right; vertical-align: baseline; font-weight: 400; }
thead th { color: var(--soft); font-size: 13px; border-bottom: 1px solid var(--line);
  vertical-align: bottom; }
thead .span { text-align: center; white-space: nowrap; }
thead tr:not(:last-child) th { border-bottom: 0; }
th:first-child { text-align: left; padding-left: 0; }
th, td { overflow-wrap: break-word; }
.numbers tbody th { max-width: 300px; }
.numbers { width: 100%; font-size: 14px; }
.numbers.narrow { width: auto; }
.numbers td { white-space: nowrap; }
.numbers .word { text-align: left; }
.numbers .wide { white-space: normal; min-width: 220px; }
tbody tr { border-bottom: 1px solid var(--line); }
tbody tr:last-child { border-bottom: 0; }
tr.group { border-bottom: 1px solid var(--line); }
tr.group th { text-align: left; font-weight: 650; padding-top: 14px; }
tr.strong th, tr.strong td { font-weight: 650; }
.by-prior td, .by-frame td { color: var(--soft); }
.parameters tbody th { min-width: 220px; }
.raw { font-size: 12px; }
.raw th, .raw td { padding: 2px 7px; }
.fitted { font-size: 16.5px; font-weight: 600; }
.levels { max-width: 720px; }
.numbers.levels tbody th { max-width: none; }
.parts { margin-top: 4px; font-size: 13.5px; color: var(--soft); }
.parts th { white-space: nowrap; color: var(--ink); }
.numbers.files td { white-space: normal; overflow-wrap: anywhere; }
.hash { font-size: 11.5px; display: block; min-width: 22ch; }
.pairs { font-size: 14px; }
.pairs th { text-align: left; color: var(--soft); padding-left: 0; }
.pairs td { text-align: left; }
.columns { columns: 2; column-gap: 44px; }
.columns .block { break-inside: avoid; padding-top: 1px; }
.columns .pairs { width: 100%; }
.columns th { width: 40%; }
.columns td { overflow-wrap: anywhere; }
.tiles { display: grid; grid-template-columns: repeat(3, 1fr); gap: 14px; margin: 4px 0 18px; }
.tile { border: 1px solid var(--line); border-radius: 6px; padding: 12px 14px; }
.tile.predicted { border-style: dashed; }
.tile p { margin: 0; }
.tile .label { font-size: 13px; line-height: 1.35; }
.tile .value { font-size: 28px; font-weight: 600; line-height: 1.4;
  font-variant-numeric: tabular-nums; }
.tile .value span { font-size: 15px; font-weight: 400; color: var(--soft); }
.tile .basis { font-size: 12.5px; color: var(--soft); line-height: 1.35; }
.tile.outside .value { color: var(--soft); }
.truth { margin-top: 18px; padding: 12px 16px; border: 1px dashed var(--soft); border-radius: 6px; }
.truth h3 { margin-top: 0; }
.legend { font-size: 13.5px; color: var(--soft); }
.legend svg { width: 12px; height: 12px; margin: 0 3px 0 14px; vertical-align: -1px; }
.legend svg:first-child { margin-left: 0; }
.swatch { display: inline-block; width: 14px; height: 10px; margin: 0 4px 0 12px; }
.swatch:first-child { margin-left: 0; }
.swatch.fit { background: var(--accent); }
.swatch.check { border: 1.5px solid var(--accent); }
.swatch.curve { height: 0; border-top: 2px solid var(--ink); vertical-align: 4px; }
.beside { display: grid; grid-template-columns: minmax(0, 3fr) minmax(0, 2fr); gap: 28px;
  align-items: start; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 20px; }
.discs { display: flex; flex-wrap: wrap; gap: 10px 14px; }
figure { margin: 0; width: 226px; break-inside: avoid; }
figcaption { font-size: 13.5px; color: var(--soft); text-align: center; line-height: 1.35; }
figcaption strong { color: var(--ink); }
details { margin-top: 20px; }
summary { cursor: pointer; font-weight: 600; margin-bottom: 8px; }
.signatures, .on-paper { display: none; }
svg.chart { display: block; width: 100%; height: auto; }
.small-plots { display: grid; grid-template-columns: repeat(3, 1fr); gap: 10px 14px; }
svg text { font-size: 12px; fill: var(--ink); font-variant-numeric: tabular-nums; }
svg .tick { fill: var(--soft); font-size: 11.5px; }
svg .panel { font-size: 13px; font-weight: 600; }
svg .flag { fill: var(--alarm); font-size: 11px; }
svg .strong { font-weight: 600; }
svg .label, svg .flag { paint-order: stroke; stroke: var(--paper); stroke-width: 3px;
  stroke-linejoin: round; }
svg .grid { stroke: var(--line); stroke-width: 0.8; fill: none; }
svg .zero { stroke: var(--soft); stroke-width: 1; }
svg .band { fill: var(--band); }
svg .stem { stroke: var(--before); stroke-width: 1; opacity: 0.55; }
svg .fit.before { fill: var(--before); }
svg .check.before { fill: var(--paper); stroke: var(--before); stroke-width: 1.4; }
svg .outlier.before { stroke: var(--alarm); stroke-width: 1.4; opacity: 0.55; fill: none; }
svg .fit.after { fill: var(--accent); }
svg .check.after { fill: var(--paper); stroke: var(--accent); stroke-width: 1.5; }
svg .outlier.after { stroke: var(--alarm); stroke-width: 1.9; fill: none; }
svg .collapsed { fill: var(--ink); }
svg .bar-fit { fill: var(--accent); }
svg .bar-check { fill: var(--paper); stroke: var(--accent); stroke-width: 1.5; }
svg .curve { fill: none; stroke: var(--ink); stroke-width: 1.6; }
svg .disc { fill: var(--wash); stroke: var(--line); }
svg .equator { fill: none; stroke: var(--soft); stroke-width: 1.2; }
svg .ball { fill: var(--accent-wash); stroke: var(--accent); stroke-width: 1.4; }
svg .limit { stroke: var(--alarm); stroke-width: 1.4; fill: none; }
svg .certified { stroke: var(--soft); stroke-width: 1; stroke-dasharray: 5 4; }
svg .axis { stroke: var(--ink); stroke-width: 1.4; }
svg .base { fill: var(--ink); }
svg.bar { display: block; width: 150px; height: 16px; margin-left: auto; position: relative;
  top: 3px; }
svg.bar .reach { stroke: var(--accent); stroke-width: 1.6; }
svg.bar .dot { fill: var(--accent); }
svg.bar .hollow { fill: var(--paper); stroke: var(--soft); stroke-width: 1.4; }
.by-prior svg.bar .reach, .by-frame svg.bar .reach { stroke: var(--soft); }
@media screen and (max-width: 760px) {
  main { padding: 18px 14px 48px; }
  .columns { columns: 1; }
  .tiles, .beside, .pair, .small-plots { grid-template-columns: 1fr; }
  .residuals, .error-map, .checks { min-width: 700px; }
  .numbers { font-size: 13px; }
  .numbers th, .numbers td { padding-left: 6px; padding-right: 6px; }
  .numbers th:first-child { padding-left: 0; }
  .numbers tbody th { max-width: 46vw; }
  .parameters tbody th { min-width: 92px; }
  .parameters small { display: block; font-size: 11.5px; line-height: 1.25; }
  .discs { justify-content: center; }
  .lead { font-size: 15.5px; }
}
@page { size: A4; margin: 15mm 14mm; }
@media print {
  :root {
    color-scheme: light;
    --paper: #ffffff; --ink: #000000; --soft: #444444; --line: #c4c9cf; --wash: #f4f6f8;
    --accent: #0a5fa8; --accent-wash: #eef4fa; --alarm: #b84300; --alarm-wash: #fdf3ec;
    --before: #9dbfdd; --band: #eaf1f8;
  }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  body { font-size: 9.5pt; line-height: 1.4; }
  main { max-width: none; padding: 0; }
  h1 { font-size: 17pt; } h2 { font-size: 12.5pt; } h3 { font-size: 10.5pt; }
  h2, h3, .legend { break-after: avoid; }
  section { margin-top: 16pt; padding-top: 8pt; }
  p { margin-bottom: 5pt; }
  .lead { font-size: 10.5pt; max-width: none; }
  .verdict { padding: 9pt 12pt; margin: 10pt 0; }
  .tile { padding: 6pt 9pt; }
  .tile .label, .tile .basis { font-size: 8pt; }
  .tile .value { font-size: 16pt; }
  .tile .value span { font-size: 10pt; }
  .numbers, .pairs { font-size: 8.5pt; }
  .raw { font-size: 6.5pt; }
  .raw th, .raw td { padding: 1px 3px; }
  th, td { padding: 2px 7px; }
  .note, .legend, small, figcaption, thead th { font-size: 8pt; }
  .hash { font-size: 7pt; }
  .scroll { overflow: visible; background: none; }
  thead { display: table-header-group; }
  tr, svg, .tile, .verdict, .truth, .levels, .parts { break-inside: avoid; }
  figure { width: 23%; }
  .numbers:not(.raw) tbody { break-inside: avoid; }
  svg.bar { height: 12px; top: 2px; }
  details:not([open]) { display: none; }
  details:not([open]) + .on-paper { display: block; }
  details[open] summary { font-size: 0; }
  .signatures { display: grid; grid-template-columns: 2fr 1fr 2fr; gap: 24pt; margin-top: 40pt;
    break-inside: avoid; }
  .signatures p { border-top: 1px solid var(--ink); padding-top: 3pt; margin: 0; }
}
)css";
}

}  // namespace cellcal::daemon::report
