// Residuals before and after, check touches, and their interpretation.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include "calib/svg/svg.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

constexpr double kFewDegrees = 10.0;  // with fewer, a scatter is uncertain by more than a fifth

std::string row(std::string_view what, const calib::ResidualSummary& summary, bool strong) {
  const std::string open =
      fmt::format("<tr{}><th scope=\"row\">{}</th><td>{}</td>", strong ? " class=\"strong\"" : "",
                  what, std::max(summary.count, 0));
  if (summary.count <= 0) {
    return open + "<td>\xE2\x80\x93</td><td>\xE2\x80\x93</td><td>\xE2\x80\x93</td></tr>\n";
  }
  return fmt::format("{}<td>{}</td><td>{}</td><td>{}</td></tr>\n", open, mm(summary.mean_m),
                     mm(summary.max_m), mm(summary.rms_m));
}

std::string group(std::string_view heading) {
  return fmt::format("<tr class=\"group\"><th scope=\"colgroup\" colspan=\"5\">{}</th></tr>\n",
                     heading);
}

std::string noise_words(const View& view) {
  const calib::Calibration& result = view.result;
  if (!(result.touch_noise_m > 0.0) || !(result.chi2_per_dof > 0.0)) {
    return "The touch scatter was not determined.";
  }
  const bool ripple = result.level.ripple_rad > 0.0;
  std::string words = fmt::format(
      "Touch scatter {} mm (1&sigma;, from the fit{}), {} mm in the cell file{}. &chi;&sup2; "
      "per degree of freedom is {}; expected is 1 from {}.",
      positive_mm(result.touch_noise_m), view.any_point() ? ", along each axis" : "",
      positive_mm(result.cell.touch_sigma_m), ripple ? ", to which the model adds gear ripple" : "",
      fixed(result.chi2_per_dof, 2), ripple ? "both together" : "the scatter in the cell file");
  if (is_known(result.repeats.degrees_of_freedom))
    words +=
        fmt::format(" Repeated touches scatter by {} mm ({} of freedom); {} mm is used in the fit.",
                    positive_mm(result.repeats.scatter_m),
                    result.repeats.degrees_of_freedom < 1.5
                        ? "one degree"
                        : fixed(result.repeats.degrees_of_freedom, 0) + " degrees",
                    positive_mm(result.repeats.used_m));
  if (result.chi2_per_dof > 1.0) words += " Every &sigma; in this report is widened accordingly.";
  if (const double degrees = result.degrees_of_freedom; is_known(degrees)) {
    words += fmt::format(" It rests on about {} of freedom{}.",
                         degrees < 1.5 ? "one degree" : fixed(degrees, 0) + " degrees",
                         degrees < kFewDegrees ? ": a rough figure" : "");
  }
  return words;
}

std::string tile(std::string_view label, std::string_view value, std::string_view basis,
                 std::string_view css_class) {
  return fmt::format(
      "<div class=\"tile {}\"><p class=\"label\">{}</p><p class=\"value\">{}</p>"
      "<p class=\"basis\">{}</p></div>\n",
      css_class, label, value, basis);
}

std::string big_mm(double metres) { return mm(metres) + " <span>mm</span>"; }

std::string predicted_tile(std::string_view label, std::string_view where, double mean_m,
                           bool outside_scope) {
  if (!is_known(mean_m)) {
    return tile(label, positive_mm(0.0), "not predicted", "missing");
  }
  return tile(label, big_mm(mean_m),
              fmt::format("predicted, mean over {}{}", where,
                          outside_scope ? "; outside the scope of the verdict" : ""),
              outside_scope ? "predicted outside" : "predicted");
}

std::string tiles(const View& view) {
  const calib::Calibration& result = view.result;
  std::string out = "<div class=\"tiles\">\n";
  if (result.check.count > 0) {
    out +=
        tile("Residual on held-out touches (M1)", big_mm(result.check.mean_m),
             fmt::format("measured, mean of {}",
                         counted(static_cast<std::size_t>(result.check.count), "touch", "touches")),
             "measured");
  } else {
    out += tile("Residual on held-out touches (M1)", "\xE2\x80\x93",
                "not measured: no touch was held out", "missing");
  }
  out += predicted_tile("3-D error near the targets (M2)",
                        "postures like those of the touches, the tip within 150&nbsp;mm of a "
                        "target&rsquo;s centre along each axis",
                        result.predicted_near_targets_m, false);
  out += predicted_tile("3-D error over the workspace (M3)",
                        "postures all over the region in front of the robot: first axis within "
                        "60&deg; of its middle, the others in the middle three quarters",
                        result.predicted_workspace_m,
                        result.verdict.publish() && !result.verdict.workspace);
  return out + "</div>\n";
}

bool any_of_kind(const View& view, calib::TargetKind kind) {
  return std::any_of(view.result.targets.begin(), view.result.targets.end(),
                     [&](const calib::TargetResult& target) { return target.kind == kind; });
}

/// Meaning of the residual for each kind of target present.
std::string residual_words(const View& view) {
  using calib::TargetKind;
  std::vector<std::string_view> parts;
  const bool centred = any_of_kind(view, TargetKind::kSphere) || view.result.targets.empty();
  if (centred)
    parts.push_back(
        "distance of the tip from the target&rsquo;s centre minus the effective radius");
  if (any_of_kind(view, TargetKind::kPlane))
    parts.push_back("signed distance of the tip&rsquo;s ball from the plane");
  if (any_of_kind(view, TargetKind::kWire))
    parts.push_back("distance of the tip from the wire&rsquo;s end minus the length read");
  if (any_of_kind(view, TargetKind::kPoint))
    parts.push_back(parts.empty() ? "distance of the tip from the point"
                                  : "on points, the distance of the tip from them");
  if (any_of_kind(view, TargetKind::kTracker))
    parts.push_back("distance of the tip from the tracker&rsquo;s reading");
  std::string words;
  for (const std::string_view part : parts) {
    if (!words.empty()) words += "; ";
    words += part;
  }
  return words + ".";
}

std::string predicted_words(const View& view) {
  if (!is_known(view.result.predicted_near_targets_m) &&
      !is_known(view.result.predicted_workspace_m)) {
    return "<p>No 3-D error was predicted. To measure accuracy, use an independent instrument, "
           "for example a laser tracker.</p>\n";
  }
  const double ripple_rad = view.result.level.ripple_rad;
  return fmt::format(
      "<p><strong>Predicted is not measured.</strong> M2 and M3 follow from the covariance of "
      "the parameters, after the best alignment of the base. They are valid as far as the "
      "model is: temperature, and a tool that moved since, are not in them{}. To measure "
      "accuracy, use an independent instrument, for example a laser tracker.</p>\n",
      std::isfinite(ripple_rad) && ripple_rad > 0.0 ? "; gear ripple is, as noise of every joint"
                                                    : "");
}

std::string truth_block(const View& view) {
  if (view.input.truth.empty()) return {};
  std::string rows;
  for (const auto& [figure, value] : view.input.truth) {
    rows += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escape(figure),
                        escape(value));
  }
  return fmt::format(
      "<div class=\"truth\">\n<h3>Simulated cell: the truth is known</h3>\n<p>These figures "
      "compare the result with the hidden errors of the simulation. A real cell has no such "
      "table.</p>\n<table class=\"pairs\">\n{}</table>\n</div>\n",
      rows);
}

}  // namespace

std::string figures_table(const View& view) {
  const calib::Calibration& result = view.result;
  std::string body =
      "<div class=\"beside\">\n<div class=\"scroll\"><table class=\"numbers figures\">\n<thead><tr>"
      "<th scope=\"col\">Residual without its sign, mm</th><th scope=\"col\">touches</th>"
      "<th scope=\"col\">mean</th><th scope=\"col\">max</th><th scope=\"col\">rms</th></tr></thead>"
      "\n<tbody>\n";
  body += group("Fitted touches");
  body += row("before: nominal robot, stiff tool", result.before, false);
  body += row("after: calibrated robot", result.after, false);
  body += group("Held-out touches (check)");
  body += row("before: nominal robot, stiff tool", result.check_before, false);
  body += row("after: calibrated robot", result.check, true);
  body += "</tbody>\n</table></div>\n<div>\n";
  body += fmt::format(
      "<p class=\"note\">Residual: {} <em>Before</em>: nominal robot; the places of the "
      "targets, the radius offset and the tip (within their tolerances in the cell file) are "
      "fitted to it, so that only the robot&rsquo;s error counts. With few touches on a target "
      "it is small. <em>After</em>: robot, tool and targets as calibrated. Held-out touches "
      "are used in neither.{}</p>\n",
      residual_words(view), view.outliers > 0 ? " Outliers are in neither." : "");
  body += fmt::format("<p class=\"note\">{}</p>\n", noise_words(view));
  if (result.check.count <= 0) {
    body +=
        "<p class=\"note\">No touch was held out, so the result is not checked on touches "
        "outside of the fit. Mark some rows <code>check</code>, or run the next session with "
        "<code>--check</code>.</p>\n";
  }
  body += "</div>\n</div>\n";
  return section("figures", "Before, after, check", body);
}

std::string meaning(const View& view) {
  std::string body = tiles(view);
  body += fmt::format(
      "<p><strong>The residual is not the accuracy of the robot.</strong> It is measured only "
      "at the targets, in the postures of the touches{}. Errors that shift arm and fitted "
      "targets together do not show in it. ",
      view.points_only() ? "" : ", and along one line, from the target&rsquo;s centre to the tip");
  if (view.touched_lengths() == 0) {
    body +=
        "A wrong scale does not show either: if all lengths of the arm are wrong in "
        "proportion, the fitted targets shift with them. Without a certified length between "
        "two targets the workspace can be wrong by 1 mm while held-out touches agree to 0.03 "
        "mm. Certify a length in the cell; more touches do not help.</p>\n";
  } else {
    body += fmt::format("Scale is determined here by {} (see Targets).</p>\n",
                        counted(view.touched_lengths(), "certified length", "certified lengths"));
  }
  body += predicted_words(view);
  body += truth_block(view);
  return section("meaning", "What the numbers mean, and what they do not", body);
}

// Whitened residuals compared with the normal distribution, to verify the assumed scatter of a touch.

namespace {

using svg::Anchor, svg::Point, svg::Svg;

constexpr double kHistogramWidth = 540.0;
constexpr double kHistogramHeight = 250.0;
constexpr double kHistogramLeft = 40.0;
constexpr double kHistogramRight = 10.0;
constexpr double kHistogramTop = 14.0;
constexpr double kHistogramBottom = 210.0;
constexpr double kBinWidth = 0.5;  // sigma
constexpr int kCurvePoints = 120;

double normal_density(double x) {
  return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
}

// Length of three normal errors: chi distribution with three degrees of freedom.
double length_density(double x) { return 2.0 * x * x * normal_density(x); }

// Expected distribution of residuals: along one line, or in space where every target is a point.
struct Shape {
  double from, to;  // sigma; only a few of 100 000 touches lie outside
  double peak;
  double (*density)(double);
  std::string_view curve, expected, expected_fitted;
};
constexpr Shape kAlongALine{
    -4.0, 4.0, 0.0, normal_density, "normal curve", "about 1", "below 1: the fit follows them"};
constexpr Shape kInSpace{0.0,
                         5.0,
                         std::numbers::sqrt2,
                         length_density,
                         "curve of a normal error in space",
                         "about 1.7",
                         "below 1.7: the fit follows them"};

struct Counts {
  explicit Counts(const Shape& shape)
      : fit(static_cast<std::size_t>((shape.to - shape.from) / kBinWidth)), check(fit.size()) {}

  std::vector<int> fit, check;  // per bin
  int fit_total = 0, check_total = 0, beyond = 0, on_points = 0;
  double fit_squares = 0.0, check_squares = 0.0;
};

Counts count(const View& view, const Shape& shape) {
  Counts counts(shape);
  for (const Mark& mark : view.marks) {
    if (mark.kind == MarkKind::kOutlier) continue;
    // Distances follow another distribution than signed residuals.
    if (mark.in_3d && !view.points_only()) {
      ++counts.on_points;
      continue;
    }
    const bool held_out = mark.kind == MarkKind::kCheck;
    ++(held_out ? counts.check_total : counts.fit_total);
    (held_out ? counts.check_squares : counts.fit_squares) += mark.whitened * mark.whitened;
    if (mark.whitened <= -shape.to || mark.whitened >= shape.to) {
      ++counts.beyond;
      continue;
    }
    const double bins = std::max(0.0, (mark.whitened - shape.from) / kBinWidth);
    const auto bin = std::min(static_cast<std::size_t>(bins), counts.fit.size() - 1);
    ++(held_out ? counts.check : counts.fit)[bin];
  }
  return counts;
}

std::string draw(const Counts& counts, const Shape& shape) {
  const int total = counts.fit_total + counts.check_total;
  double highest = total * kBinWidth * shape.density(shape.peak);
  for (std::size_t i = 0; i < counts.fit.size(); ++i) {
    highest = std::max(highest, static_cast<double>(counts.fit[i] + counts.check[i]));
  }
  const Scale across{shape.from, shape.to, kHistogramLeft, kHistogramWidth - kHistogramRight};
  const Scale up{0.0, highest * 1.05, kHistogramBottom, kHistogramTop};
  Svg svg(kHistogramWidth, kHistogramHeight, "chart histogram",
          "Histogram of residuals divided by their sigma, with the curve of pure noise");
  const std::vector<double> ticks = round_ticks(0.0, up.to, 4);
  const std::vector<std::string> labels = tick_labels(ticks);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    svg.line({kHistogramLeft, up(ticks[i])}, {kHistogramWidth - kHistogramRight, up(ticks[i])},
             ticks[i] == 0.0 ? "zero" : "grid");
    svg.text({kHistogramLeft - 7.0, up(ticks[i]) + 4.0}, Anchor::kEnd, "tick", labels[i]);
  }
  for (std::size_t i = 0; i < counts.fit.size(); ++i) {
    const double left = across(shape.from + static_cast<double>(i) * kBinWidth) + 1.0;
    const double width = across(kBinWidth) - across(0.0) - 2.0;
    const double fit_top = up(counts.fit[i]);
    if (counts.fit[i] > 0)
      svg.rectangle({left, fit_top}, width, kHistogramBottom - fit_top, "bar-fit");
    if (counts.check[i] > 0) {
      const double top = up(counts.fit[i] + counts.check[i]);
      svg.rectangle({left + 0.75, top}, width - 1.5, fit_top - top, "bar-check");
    }
  }
  std::vector<Point> curve;
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double x = shape.from + (shape.to - shape.from) * i / kCurvePoints;
    curve.push_back({across(x), up(total * kBinWidth * shape.density(x))});
  }
  svg.path(curve, "curve");
  for (double sigma = shape.from; sigma <= shape.to; sigma += 1.0) {
    svg.text({across(sigma), kHistogramBottom + 18.0}, Anchor::kMiddle, "tick", fixed(sigma, 0));
  }
  svg.text({kHistogramLeft, kHistogramTop - 3.0}, Anchor::kStart, "tick", "touches");
  svg.text({kHistogramWidth - kHistogramRight, kHistogramBottom + 36.0}, Anchor::kEnd, "tick",
           "residual divided by its \xCF\x83");
  return std::move(svg).finish();
}

std::string scatter_words(int total, double squares) {
  return total > 0 ? fixed(std::sqrt(squares / total), 2) : std::string("\xE2\x80\x93");
}

std::string left_out(const Counts& counts, const Shape& shape) {
  std::string words;
  if (counts.beyond > 0) {
    words +=
        fmt::format("<p class=\"warn\">{} further out than {}&sigma; and not drawn.</p>\n",
                    counted(static_cast<std::size_t>(counts.beyond), "touch lies", "touches lie"),
                    fixed(shape.to, 0));
  }
  if (counts.on_points > 0) {
    words += fmt::format(
        "<p class=\"note\">{} not drawn: distances in space follow another curve.</p>\n",
        counted(static_cast<std::size_t>(counts.on_points), "touch on a point is",
                "touches on points are"));
  }
  return words;
}

}  // namespace

std::string residual_histogram(const View& view) {
  const Shape& shape = view.points_only() ? kInSpace : kAlongALine;
  const Counts counts = count(view, shape);
  if (counts.fit_total + counts.check_total == 0) {
    return section("distribution", "Residual distribution",
                   "<p>There are no residuals to count.</p>\n");
  }
  const std::string body = fmt::format(
      "<div class=\"beside\">\n<div class=\"scroll\">{}</div>\n<div>\n<p class=\"legend\"><i "
      "class=\"swatch fit\"></i>fitted <i class=\"swatch check\"></i>held out <i "
      "class=\"swatch curve\"></i>{}</p>\n<p>Residuals divided by their expected scatter. Bars "
      "that follow the curve: only touch noise is left. Wider: the model lacks an effect, or "
      "the stated touch &sigma; is too small. Narrower: the stated &sigma; is too large, or "
      "the touches are so few that the fit follows each of them. {}</p>\n<table "
      "class=\"pairs\">\n<tr><th scope=\"row\">rms, fitted ({})</th><td>{}</td></tr>\n<tr><th "
      "scope=\"row\">rms, held out ({})</th><td>{}</td></tr>\n</table>\n{}</div>\n</div>\n",
      draw(counts, shape), shape.curve,
      view.points_only()
          ? ""
          : "Held-out ones to one side: a common cause such as the trigger or a worn tip.",
      shape.expected_fitted, scatter_words(counts.fit_total, counts.fit_squares), shape.expected,
      scatter_words(counts.check_total, counts.check_squares), left_out(counts, shape));
  return section("distribution", "Residual distribution", body);
}

}  // namespace cellcal::daemon::report
