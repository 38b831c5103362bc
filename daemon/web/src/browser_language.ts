// uPlot makes a number format of the browser's language as it is loaded. A browser that was started without a locale, like that of a
// panel without a desktop, states "C", which is none: nothing of the page would be shown. Imported before uPlot.

if (typeof navigator !== "undefined") { // as it is in node
  try {
    new Intl.NumberFormat(navigator.language);
  } catch {
    Object.defineProperty(navigator, "language", { value: "en" });
  }
}
