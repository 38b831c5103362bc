// One chart of numbers over numbers. Its content is also stated as text, and as a table where the caller provides one.

import { useEffect, useRef } from "preact/hooks";
import "../browser_language";
import uPlot from "uplot";
import { useVoice } from "./context";

export interface Line {
  label: string;
  /** Name of a CSS colour variable of style.css. */
  colour: string;
  values: (number | null)[];
  /** Points only, each a mark of this shape; without: a line. */
  marks?: "circle" | "square" | "triangle";
  dashed?: boolean;
}

const HEIGHT = 210;
const MARK = 4; // half a mark's width

const colour_of = (name: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** Shapes differ, so that marks are distinguishable without colour. */
function draw_marks(shape: NonNullable<Line["marks"]>, colour: string): uPlot.Series.Points.Show {
  return (chart, series, from, to) => {
    const { ctx } = chart;
    const size = MARK * devicePixelRatio;
    ctx.save();
    ctx.fillStyle = colour;
    for (let i = from; i <= to; ++i) {
      const y = chart.data[series]?.[i], x = chart.data[0][i];
      if (y === null || y === undefined || x === undefined) continue;
      const left = chart.valToPos(x, "x", true), top = chart.valToPos(y, "y", true);
      ctx.beginPath();
      if (shape === "circle") ctx.arc(left, top, size, 0, 2 * Math.PI);
      else if (shape === "square") ctx.rect(left - size, top - size, 2 * size, 2 * size);
      else {
        ctx.moveTo(left, top - 1.3 * size);
        ctx.lineTo(left + 1.2 * size, top + size);
        ctx.lineTo(left - 1.2 * size, top + size);
      }
      ctx.fill();
    }
    ctx.restore();
    return false;
  };
}

export interface ChartProps {
  label: string;
  x: number[];
  x_label: string;
  y_label: string;
  lines: Line[];
  time?: boolean;
  /** Lower end of y; null: minimum of the values. */
  from?: number | null;
  /** Values of x marked by numbered lines, in the order of the caller's list; 0: unknown, not drawn. */
  events?: number[];
  /** Pairs of neighbouring values of x between which lines are interrupted. */
  breaks?: [number, number][];
}

export function Chart(props: ChartProps) {
  const { theme, language } = useVoice();
  const box = useRef<HTMLDivElement>(null);
  const { x, lines, events, breaks } = props;
  useEffect(() => {
    const parent = box.current;
    if (!parent) return;
    const chart = new uPlot(options(props, parent.clientWidth, language), [x, ...lines.map((line) => line.values)], parent);
    const look = new ResizeObserver(() => chart.setSize({ width: parent.clientWidth, height: HEIGHT }));
    look.observe(parent);
    return () => {
      look.disconnect();
      chart.destroy();
    };
  }, [theme, language, x, lines, events, breaks]);
  return (
    <figure class="chart">
      <figcaption>{props.y_label}</figcaption>
      <div ref={box} role="img" aria-label={props.label} />
    </figure>
  );
}

/** Dashed lines over the whole height, numbered at the top. */
function draw_events(chart: uPlot, events: number[], colour: string): void {
  const { ctx, bbox } = chart;
  ctx.save();
  ctx.strokeStyle = ctx.fillStyle = colour;
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([4 * devicePixelRatio, 4 * devicePixelRatio]);
  ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
  ctx.textBaseline = "top";
  events.forEach((event, i) => {
    if (event === 0) return;
    const left = chart.valToPos(event, "x", true);
    if (left < bbox.left - 1 || left > bbox.left + bbox.width + 1) return;
    ctx.beginPath();
    ctx.moveTo(left, bbox.top);
    ctx.lineTo(left, bbox.top + bbox.height);
    ctx.stroke();
    ctx.textAlign = left > bbox.left + bbox.width / 2 ? "right" : "left";
    ctx.fillText(` ${i + 1} `, left, bbox.top);
  });
  ctx.restore();
}

/** Days of ticks [s since 1970], with the month in letters, since 01/05/26 is ambiguous; where a day has several, their times. */
export function tick_words(values: number[], language: string): string[] {
  const day = new Intl.DateTimeFormat(language, { day: "numeric", month: "short", year: "2-digit" });
  const apart_s = (values[1] ?? 0) - (values[0] ?? 0);
  const time = new Intl.DateTimeFormat("sv-SE", { timeStyle: apart_s < 60 ? "medium" : "short" });
  const days = values.map((value) => day.format(value * 1000));
  if (new Set(days).size === days.length) return days;
  return values.map((value, i) => time.format(value * 1000) + (i > 0 && days[i] === days[i - 1] ? "" : `\n${days[i]}`));
}

function options({ x_label, lines, time, from = 0, events = [], breaks = [] }: ChartProps, width: number, language: string): uPlot.Options {
  const ink = colour_of("ink-soft"), grid = colour_of("line");
  const axis = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 },
                 font: "13px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif" };
  const number = new Intl.NumberFormat(language, { maximumSignificantDigits: 4 });
  const numbers = (_: uPlot, values: number[]) => values.map((value) => number.format(value));
  const days = (_: uPlot, values: number[]) => tick_words(values, language);
  return {
    width, height: HEIGHT,
    scales: {
      x: { time: time ?? false, range: (_, low, high) => {
        const known = events.filter((event) => event !== 0);
        const first = Math.min(low, ...known), last = Math.max(high, ...known);
        return first === last ? [first - 1, last + 1] : [first, last];
      } },
      y: { range: (_, low, high) => {
        const lowest = from ?? low ?? 0, highest = high ?? 1;
        const room = 0.08 * (highest - lowest) || 0.1;
        return [from ?? lowest - room, highest + room];
      } },
    },
    legend: { live: false },
    cursor: { show: false },
    hooks: { draw: [(chart) => draw_events(chart, events, ink)] },
    axes: [
      { ...axis, label: x_label, labelSize: 18, size: (_, words) => (words?.some((one) => one.includes("\n")) ? 50 : 32), incrs: time ? undefined : [1, 2, 5, 10, 20, 50, 100],
        values: time ? days : numbers, space: time ? 90 : 40 },
      { ...axis, size: 58, values: numbers },
    ],
    series: [
      {},
      ...lines.map((line): uPlot.Series => ({
        label: line.label,
        stroke: colour_of(line.colour),
        fill: line.marks ? colour_of(line.colour) : undefined,
        width: line.marks ? 0 : 2,
        dash: line.dashed ? [6, 5] : undefined,
        // Missing values are spanned, breaks are not.
        gaps: (chart) => (line.marks ? [] : breaks.map(([left, right]) => [chart.valToPos(left, "x", true), chart.valToPos(right, "x", true)])),
        paths: line.marks ? () => null : undefined,
        points: { show: line.marks ? draw_marks(line.marks, colour_of(line.colour)) : false },
      })),
    ],
  };
}
