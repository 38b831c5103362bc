// One style for the screen and for A4, black on white: a certificate is printed.

#include "daemon/certificate/form.h"

namespace cellcal::daemon::certificate {

const char* style_sheet() {
  return R"css(
@page {
  size: A4; margin: 16mm 16mm 20mm 16mm;
  @bottom-left { content: string(number); font: 8pt "DejaVu Sans", sans-serif; color: #555; }
  @bottom-right { content: "page " counter(page) " of " counter(pages);
    font: 8pt "DejaVu Sans", sans-serif; color: #555; }
}
@page wide { size: A4 landscape; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: #111; overflow-wrap: break-word;
  font: 9.5pt/1.4 "DejaVu Sans", "Liberation Sans", Arial, sans-serif; }
@media screen { body { max-width: 210mm; margin: 0 auto; padding: 16mm; } }
h1 { font-size: 19pt; margin: 0 0 1mm; font-weight: 600; }
h2 { font-size: 11.5pt; margin: 6mm 0 2mm; padding-top: 2mm; border-top: 0.3mm solid #999;
  break-after: avoid; }
h3 { font-size: 9.5pt; margin: 3mm 0 1mm; break-after: avoid; }
p, li { margin: 0 0 1.5mm; orphans: 3; widows: 3; }
ol, ul { margin: 0; padding-left: 6mm; }
.emulated { border: 1mm solid #b00; padding: 2mm 4mm; font-weight: bold; }
.number { string-set: number content(); font-size: 11pt; margin-bottom: 4mm; }
.result { border: 0.5mm solid #111; padding: 3mm 4mm; margin: 3mm 0; break-inside: avoid; }
.result p { margin: 0; }
.result .verdict { font-size: 12.5pt; font-weight: 600; }
table { border-collapse: collapse; width: 100%; margin: 0 0 2mm; }
thead { display: table-header-group; }
tr { break-inside: avoid; }
th, td { text-align: left; vertical-align: top; padding: 0.7mm 2mm 0.7mm 0; font-weight: normal;
  border-bottom: 0.15mm solid #ccc; }
thead th { font-weight: 600; border-bottom: 0.3mm solid #555; vertical-align: bottom; }
.pairs th { width: 42mm; color: #444; }
td.n, th.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.whole { break-inside: avoid; }
.note { font-size: 8.5pt; color: #333; }
.hash { font: 7.5pt "DejaVu Sans Mono", monospace; overflow-wrap: anywhere; }
.small, .small td, .small th { font-size: 7.5pt; padding-top: 0.4mm; padding-bottom: 0.4mm; }
td.word { overflow-wrap: anywhere; }
.wide { page: wide; break-before: page; }
.signatures { break-inside: avoid; margin-top: 10mm; }
.sign td { border: 0; padding-top: 12mm; width: 33%; }
.sign span { display: block; border-top: 0.3mm solid #111; padding-top: 1mm; }
.appendix { break-before: page; }
)css";
}

}  // namespace cellcal::daemon::certificate
