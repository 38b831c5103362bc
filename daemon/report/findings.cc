// What the touches do not determine, which of them were left out, and which parameters go together.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "calib/result/unidentifiable.h"
#include "daemon/report/drawing/text.h"
#include "daemon/report/sections.h"

namespace cellcal::daemon::report {
namespace {

constexpr std::string_view kNothing = "\xE2\x80\x93";
constexpr std::size_t kMostPairs = 20;
constexpr std::size_t kMostShares = 6;  // of one direction; the rest is small
constexpr double kLeastShare = 0.05;
constexpr int kShareDecimals = 2;
constexpr int kCorrelationDecimals = 3;

std::string shares_of(const View& view, const calib::UnidentifiableDirection& direction) {
  auto shares = direction.direction;
  std::stable_sort(shares.begin(), shares.end(), [](const auto& one, const auto& other) {
    return std::abs(one.second) > std::abs(other.second);
  });
  std::string words;
  std::size_t shown = 0;
  for (const auto& [key, share] : shares) {
    if (shown == kMostShares || !(std::abs(share) >= kLeastShare)) break;
    words += fmt::format("{}<code>{}</code>&nbsp;{}", shown == 0 ? "" : ", ",
                         escape(parameter_name(view.result.cell, key)),
                         signed_fixed(share, kShareDecimals));
    ++shown;
  }
  return words;
}

std::string outlier_row(const View& view, const calib::Outlier& outlier) {
  std::string target(kNothing);
  std::string line(kNothing);
  if (outlier.touch < view.input.touches.size()) {
    const calib::Touch& touch = view.input.touches[outlier.touch];
    target = escape(touch.target);
    if (touch.line > 0) line = fmt::format("{}", touch.line);
  }
  const std::string reason = words(outlier);
  return fmt::format(
      "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"word\">{}</td><td>{}</td>"
      "<td class=\"word wide\">{}</td></tr>\n",
      outlier.touch + 1, line, target, signed_mm(outlier.residual_m),
      reason.empty() ? std::string("reason not recorded") : escape(reason));
}

// For comparing one plan of touches with another.
std::string observability_words(const calib::Observability& o) {
  if (o.rows <= 0) return {};
  const auto number = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.3g}", value) : std::string(kNothing);
  };
  return fmt::format(
      "<p id=\"observability\">Of the geometry&rsquo;s {} (without the frame) {} are "
      "observable, {} determined better than their tolerance. Observability: O1&nbsp;{} "
      "(average information of a touch), O2&nbsp;{} (how evenly), O3&nbsp;{} (the worst "
      "direction), O4&nbsp;{} (noise amplification), O5&nbsp;{} (all directions together); "
      "scaled condition number {}.</p>\n",
      counted(static_cast<std::size_t>(std::max(0, o.directions)), "direction", "directions"),
      o.rank, o.determined, number(o.o1), number(o.o2), number(o.o3), number(o.o4), number(o.o5),
      number(o.condition));
}

}  // namespace

std::string unidentifiable(const View& view) {
  const auto& directions = view.result.unidentifiable;
  if (view.result.verdict.too_few) {
    return section("unidentifiable", "Unobservable directions",
                   "<p>Nearly all parameters: the touches are too few to calibrate.</p>\n");
  }
  if (directions.empty()) {
    return section(
        "unidentifiable", "Unobservable directions",
        (view.result.observability.rows > 0 ? "<p>No undetermined direction was found.</p>\n"
                                            : "<p>Not examined.</p>\n") +
            observability_words(view.result.observability));
  }
  std::string items;
  for (const calib::UnidentifiableDirection& direction : directions) {
    const std::string shares = shares_of(view, direction);
    items +=
        fmt::format("<li>{}{}</li>\n", escape(words(view.result.cell, direction)),
                    shares.empty() ? std::string() : fmt::format("<br><small>{}</small>", shares));
  }
  const std::string body = fmt::format(
      "<p>Not determined by the touches: {} of the parameters. Along each the result stays at "
      "nominal, within the tolerances. The numbers are shares in units of each "
      "parameter&rsquo;s tolerance.</p>\n<ol>\n{}</ol>\n{}",
      counted(directions.size(), "combination", "combinations"), items,
      observability_words(view.result.observability));
  return section("unidentifiable", "Unobservable directions", body);
}

std::string outliers(const View& view) {
  const auto& list = view.result.outliers;
  if (list.empty()) {
    return section("outliers", "Outliers", "<p>No touch was left out.</p>\n");
  }
  std::string rows;
  for (const calib::Outlier& outlier : list) rows += outlier_row(view, outlier);
  const std::string body = fmt::format(
      "<p>Left out of the fit and of the figures before and after; drawn as crosses.</p>\n<div "
      "class=\"scroll\">"
      "<table class=\"numbers\">\n<thead><tr><th scope=\"col\">touch</th>"
      "<th scope=\"col\">line of file</th><th scope=\"col\" class=\"word\">target</th>"
      "<th scope=\"col\">residual, mm</th><th scope=\"col\" class=\"word\">reason</th></tr></thead>"
      "\n<tbody>\n{}</tbody>\n</table></div>\n",
      rows);
  return section("outliers", "Outliers", body);
}

std::string correlations(const View& view) {
  const calib::Correlations strong = calib::strong_correlations(view.result);
  constexpr std::string_view kHeading = "Strongly correlated parameters";
  if (!strong.available) {
    return section("correlations", kHeading,
                   "<p>Not known: the calibration has no usable covariance.</p>\n");
  }
  const std::string_view frame =
      strong.frame_removed ? "Frame directions fixed. " : "Frame directions included. ";
  const std::size_t of_frame = strong.of_targets_or_frame;
  const std::string left_out =
      of_frame == 0 ? std::string()
                    : fmt::format(
                          "<p class=\"note\">Not listed: {} with a coordinate of a target or "
                          "of the frame, which are no property of the robot.</p>\n",
                          counted(of_frame, "pair", "pairs"));
  if (strong.pairs.empty()) {
    return section("correlations", kHeading,
                   fmt::format("<p>{}No two parameters of robot, tool and touch correlate by more "
                               "than {}.</p>\n{}",
                               frame, fixed(calib::kStrongCorrelation, 1), left_out));
  }
  std::string rows;
  const std::size_t shown = std::min(strong.pairs.size(), kMostPairs);
  for (std::size_t i = 0; i < shown; ++i) {
    const calib::CorrelatedPair& pair = strong.pairs[i];
    rows += fmt::format(
        "<tr><th scope=\"row\"><code>{}</code></th><td class=\"word\"><code>{}</code></td>"
        "<td>{}</td></tr>\n",
        escape(name_of(view, view.result.parameters[pair.first])),
        escape(name_of(view, view.result.parameters[pair.second])),
        signed_fixed(pair.correlation, kCorrelationDecimals));
  }
  std::string body = fmt::format(
      "<p>{}Of a pair beyond &plusmn;{} a combination is determined much better than either "
      "value: read them together.</p>\n<div class=\"scroll\"><table class=\"numbers "
      "narrow\">\n<thead><tr><th scope=\"col\">parameter</th><th scope=\"col\" "
      "class=\"word\">and</th><th "
      "scope=\"col\">correlation</th></tr></thead>\n<tbody>\n{}</tbody>\n</table></div>\n",
      frame, fixed(calib::kStrongCorrelation, 1), rows);
  if (strong.pairs.size() > shown) {
    body +=
        fmt::format("<p class=\"note\">The strongest {} of {}.</p>\n", shown, strong.pairs.size());
  }
  return section("correlations", kHeading, body + left_out);
}

}  // namespace cellcal::daemon::report
