// Residuals before and after, check touches, and their interpretation.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include "calib/export/svg.h"
#include "daemon/report/axes.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

constexpr double kFewDegrees = 10.0;  // with fewer, a scatter is uncertain by more than a fifth

void add_row(const std::string& what, const calib::ResidualSummary& summary,
             std::string_view css_class, Table& table) {
  const auto shown = [&](double metres) { return summary.count > 0 ? mm(metres) : kDash; };
  table.row({what, std::to_string(std::max(summary.count, 0)), shown(summary.mean_m),
             shown(summary.max_m), shown(summary.rms_m)},
            css_class);
}

std::string freedom_words(double degrees) {
  return degrees < 1.5 ? say("say.report.noise.one_degree")
                       : say({"say.report.noise.degrees", {{"n", fixed(degrees, 0)}}});
}

std::string freedom_sentence(double degrees) {
  if (!is_known(degrees)) return {};
  return say({degrees < kFewDegrees ? "say.report.noise.rests.roughly" : "say.report.noise.rests",
              {{"freedom", freedom_words(degrees)}}});
}

std::string noise_words(const View& view) {
  const calib::Calibration& result = view.result;
  // Scatter and repeats are of the last full session; an update widens nothing.
  if (result.update)
    return say({"say.report.noise.update", {{"chi2", fixed(result.chi2_per_dof, 2)}}}) +
           freedom_sentence(result.degrees_of_freedom);
  if (!(result.touch_noise_m > 0.0) || !(result.chi2_per_dof > 0.0))
    return say("say.report.noise.none");
  std::string words =
      say({result.level.ripple_rad > 0.0 ? "say.report.noise.ripple" : "say.report.noise",
           {{"found", positive_mm(result.touch_noise_m)},
            {"axes", say(view.any_point() ? "say.report.noise.along_each_axis"
                                          : "say.report.noise.from_the_fit")},
            {"stated", positive_mm(result.cell.touch_sigma_m)},
            {"chi2", fixed(result.chi2_per_dof, 2)}}});
  if (is_known(result.repeats.degrees_of_freedom))
    words += say({"say.report.noise.repeats",
                  {{"scatter", positive_mm(result.repeats.scatter_m)},
                   {"freedom", freedom_words(result.repeats.degrees_of_freedom)},
                   {"used", positive_mm(result.repeats.used_m)}}});
  if (result.chi2_per_dof > 1.0) words += say("say.report.noise.widened");
  return words + freedom_sentence(result.degrees_of_freedom);
}

std::string tile(std::string_view label, std::string_view value, std::string_view basis,
                 std::string_view css_class) {
  return fmt::format(
      "<div class=\"tile {}\"><p class=\"label\">{}</p><p class=\"value\">{}</p>"
      "<p class=\"basis\">{}</p></div>\n",
      css_class, label, value, basis);
}

std::string big_mm(double metres) { return mm(metres) + " <span>mm</span>"; }

std::string predicted_tile(const char* label, const char* where, double mean_m,
                           bool outside_scope) {
  if (!is_known(mean_m))
    return tile(say(label), positive_mm(0.0), say("say.report.tile.not_predicted"), "missing");
  return tile(
      say(label), big_mm(mean_m),
      say({outside_scope ? "say.report.tile.predicted.outside" : "say.report.tile.predicted",
           {{"where", say(where)}}}),
      outside_scope ? "predicted outside" : "predicted");
}

std::string tiles(const View& view) {
  const calib::Calibration& result = view.result;
  const std::string m1 = say("say.report.tile.m1");
  std::string out = "<div class=\"tiles\">\n";
  if (result.check.count > 0)
    out += tile(m1, big_mm(result.check.mean_m),
                counted(static_cast<std::size_t>(result.check.count), "say.report.tile.measured."),
                "measured");
  else
    out += tile(m1, kDash, say("say.report.tile.not_measured"), "missing");
  out += predicted_tile("say.report.tile.m2", "say.report.tile.near",
                        result.predicted_near_targets_m, false);
  out += predicted_tile("say.report.tile.m3", "say.report.tile.workspace",
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
  std::vector<const char*> parts;
  const bool centred = any_of_kind(view, TargetKind::kSphere) || view.result.targets.empty();
  if (centred) parts.push_back("say.report.residual_is.sphere");
  if (any_of_kind(view, TargetKind::kPlane)) parts.push_back("say.report.residual_is.plane");
  if (any_of_kind(view, TargetKind::kWire)) parts.push_back("say.report.residual_is.wire");
  if (any_of_kind(view, TargetKind::kPoint))
    parts.push_back(parts.empty() ? "say.report.residual_is.point"
                                  : "say.report.residual_is.also_point");
  if (any_of_kind(view, TargetKind::kTracker)) parts.push_back("say.report.residual_is.tracker");
  std::string words;
  for (const char* part : parts) words += (words.empty() ? "" : "; ") + say(part);
  return words + ".";
}

std::string predicted_words(const View& view) {
  if (!is_known(view.result.predicted_near_targets_m) &&
      !is_known(view.result.predicted_workspace_m))
    return paragraph("", say("say.report.predicted.none"));
  const double ripple_rad = view.result.level.ripple_rad;
  return paragraph("",
                   say(std::isfinite(ripple_rad) && ripple_rad > 0.0 ? "say.report.predicted.ripple"
                                                                     : "say.report.predicted"));
}

std::string truth_block(const View& view) {
  if (view.input.truth.empty()) return {};
  std::string rows;
  for (const auto& [figure, value] : view.input.truth) {
    rows += pair_row(escape(say(figure)), escape(value));
  }
  return fmt::format(
      "<div class=\"truth\">\n<h3>{}</h3>\n{}<table class=\"pairs\">\n{}</table>\n</div>\n",
      say("say.report.truth"), paragraph("", say("say.report.truth.note")), rows);
}

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
  const char *curve, *expected, *expected_fitted;
};
constexpr Shape kAlongALine{-4.0,
                            4.0,
                            0.0,
                            normal_density,
                            "say.report.distribution.normal",
                            "say.report.distribution.one",
                            "say.report.distribution.below_one"};
constexpr Shape kInSpace{0.0,
                         5.0,
                         std::numbers::sqrt2,
                         length_density,
                         "say.report.distribution.in_space",
                         "say.report.distribution.space",
                         "say.report.distribution.below_space"};

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
          say("say.report.distribution.picture"));
  draw_value_axis(svg, across, up, 4, 7.0);
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
  svg.text({kHistogramLeft, kHistogramTop - 3.0}, Anchor::kStart, "tick",
           say("say.report.col.touches"));
  svg.text({kHistogramWidth - kHistogramRight, kHistogramBottom + 36.0}, Anchor::kEnd, "tick",
           say("say.report.distribution.axis"));
  return std::move(svg).finish();
}

std::string scatter_words(int total, double squares) {
  return total > 0 ? fixed(std::sqrt(squares / total), 2) : kDash;
}

std::string left_out(const Counts& counts, const Shape& shape) {
  std::string words;
  if (counts.beyond > 0)
    words += paragraph("warn", say({counts.beyond == 1 ? "say.report.distribution.beyond.one"
                                                       : "say.report.distribution.beyond.many",
                                    {{"n", counts.beyond}, {"sigmas", fixed(shape.to, 0)}}}));
  if (counts.on_points > 0)
    words += paragraph("note", counted(static_cast<std::size_t>(counts.on_points),
                                       "say.report.distribution.on_points."));
  return words;
}

}  // namespace

std::string figures_table(const View& view) {
  const calib::Calibration& result = view.result;
  const std::string before = say(result.update ? "say.report.figures.before.update"
                                               : "say.report.figures.before"),
                    after = say("say.report.figures.after");
  Table table({"say.report.figures.residual", "say.report.col.touches", "say.report.col.mean",
               "say.report.col.max", "rms"},
              "figures");
  table.group(say("say.report.figures.fitted"));
  add_row(before, result.before, "", table);
  add_row(after, result.after, "", table);
  table.group(say("say.report.figures.check"));
  add_row(before, result.check_before, "", table);
  add_row(after, result.check, "strong", table);
  std::string body = "<div class=\"beside\">\n" + table.html() + "<div>\n";
  body += paragraph("note", say({result.update       ? "say.report.figures.note.update"
                                 : view.outliers > 0 ? "say.report.figures.note.outliers"
                                                     : "say.report.figures.note",
                                 {{"residual", residual_words(view)}}}));
  body += paragraph("note", noise_words(view));
  if (result.check.count <= 0 && !result.update)
    body += paragraph("note", say("say.report.figures.no_check"));
  return section("figures", "say.report.figures", body + "</div>\n</div>\n");
}

std::string meaning(const View& view) {
  const std::size_t lengths = view.touched_lengths();
  const calib::ScaleBy by = view.result.verdict.scale();
  const std::string scale = by == calib::ScaleBy::kReadings
                                ? say("say.report.meaning.scale.readings")
                            : by == calib::ScaleBy::kNothing || lengths == 0
                                ? say("say.report.meaning.no_scale")
                                : counted(lengths, "say.report.meaning.scale.");
  return section("meaning", "say.report.meaning",
                 tiles(view) +
                     paragraph("", say({view.points_only() ? "say.report.meaning.points"
                                                           : "say.report.meaning.lines",
                                        {{"scale", scale}}})) +
                     predicted_words(view) + truth_block(view));
}

// Whitened residuals compared with the normal distribution, to verify the assumed scatter of a touch.

std::string residual_histogram(const View& view) {
  const Shape& shape = view.points_only() ? kInSpace : kAlongALine;
  const Counts counts = count(view, shape);
  if (counts.fit_total + counts.check_total == 0)
    return section("distribution", "say.report.distribution",
                   paragraph("", say("say.report.distribution.none")));
  const std::string body = fmt::format(
      "<div class=\"beside\">\n<div class=\"scroll\">{}</div>\n<div>\n<p class=\"legend\"><i "
      "class=\"swatch fit\"></i>{} <i class=\"swatch check\"></i>{} <i "
      "class=\"swatch curve\"></i>{}</p>\n{}<table class=\"pairs\">\n{}{}</table>\n{}</div>\n</div>\n",
      draw(counts, shape), say("say.report.mark.fitted"), say("say.report.mark.held_out"),
      say(shape.curve),
      paragraph("", say(view.points_only() ? "say.report.distribution.note"
                                           : "say.report.distribution.note.sided")),
      pair_row(
          say({"say.report.distribution.rms.fitted", {{"expected", say(shape.expected_fitted)}}}),
          scatter_words(counts.fit_total, counts.fit_squares)),
      pair_row(say({"say.report.distribution.rms.check", {{"expected", say(shape.expected)}}}),
               scatter_words(counts.check_total, counts.check_squares)),
      left_out(counts, shape));
  return section("distribution", "say.report.distribution", body);
}

}  // namespace cellcal::daemon::report
