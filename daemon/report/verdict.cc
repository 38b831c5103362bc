// Heading of the page: whether, where and why the result may be used.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "calib/result/finding.h"
#include "calib/result/unidentifiable.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

struct Reasons {
  std::string scope;  // without its introduction; the first of them
  std::vector<std::string> against, other;
};

bool is_scope(calib::FindingKind kind) {
  return kind == calib::FindingKind::kScaleByLengths ||
         kind == calib::FindingKind::kScaleByReadings ||
         kind == calib::FindingKind::kScaleByNothing ||
         kind == calib::FindingKind::kScopeOfTouches;
}

Reasons sorted_reasons(const calib::Verdict& verdict) {
  Reasons reasons;
  for (const calib::Finding& one : verdict.findings) {
    if (reasons.scope.empty() && is_scope(one.kind)) {
      reasons.scope = calib::sentence(one);
    } else {
      const bool note = verdict.publish() || !one.withholds();
      (note ? reasons.other : reasons.against).push_back(calib::words(one));
    }
  }
  return reasons;
}

std::string sentence(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 32);
  return text.empty() ? text : escape(text) + ".";
}

std::string scope_words(const View& view, const Reasons& reasons) {
  const calib::Verdict& verdict = view.result.verdict;
  if (verdict.too_few()) {
    return "This was a first session, and the cell works. The touches are too few for a "
           "calibration: do not put the figures below into service.";
  }
  if (!verdict.publish()) {
    return "Do not put this result into service. The figures below are for diagnosis only.";
  }
  const std::string why = sentence(reasons.scope);
  if (verdict.workspace) {
    return fmt::format("Scope: the whole workspace. {}",
                       why.empty()
                           ? "A certified length was touched at both ends and determines the "
                             "scale of the arm."
                           : why);
  }
  const std::string_view elsewhere = "Elsewhere it only predicts, with a larger bound.";
  return fmt::format(
      "Scope: near the targets only, within about 150&nbsp;mm of them. {}",
      why.empty() ? fmt::format("{}{}",
                                view.touched_lengths() == 0
                                    ? "No certified length was touched: only the size of the "
                                      "targets determines the scale of the arm, and weakly. "
                                    : "",
                                elsewhere)
                  : why);
}

std::string_view headline(const calib::Verdict& verdict) {
  if (verdict.too_few()) return "The cell works; too few touches to calibrate";
  if (!verdict.publish()) return "Not publishable";
  return verdict.workspace ? "Publishable for the workspace" : "Publishable near the targets";
}

std::string data_sentence(const View& view) {
  std::string sentence = fmt::format("{} on {} determined this calibration",
                                     counted(view.fit, "touch", "touches"), target_words(view));
  if (view.check > 0) {
    sentence +=
        fmt::format(", {} held out to check it", counted(view.check, "more was", "more were"));
  } else {
    sentence += ", none was held out to check it";
  }
  if (view.outliers > 0) {
    sentence +=
        fmt::format(", and {} left out as {}", counted(view.outliers, "touch was", "touches were"),
                    view.outliers == 1 ? "an outlier" : "outliers");
  }
  return sentence + ".";
}

std::string residual_sentence(const View& view) {
  const calib::Calibration& result = view.result;
  const bool tested = result.check.count > 0;
  const calib::ResidualSummary& after = tested ? result.check : result.after;
  const bool same_touches_before = tested && result.check_before.count > 0;
  const calib::ResidualSummary& before = same_touches_before ? result.check_before : result.before;
  if (after.count <= 0) return "There are no residuals to report.";
  return fmt::format(
      "Mean residual {} (max. {}) with the nominal robot, {} (max. {}) with this calibration, "
      "on the touches {}.",
      mm_words(before.mean_m), mm_words(before.max_m), mm_words(after.mean_m),
      mm_words(after.max_m),
      tested ? "that were held out" : "of the fit, where it is smaller than elsewhere");
}

std::string list(std::string_view heading, const std::vector<std::string>& reasons) {
  if (reasons.empty()) return {};
  std::string items;
  for (const std::string& reason : reasons) items += fmt::format("<li>{}</li>\n", escape(reason));
  return fmt::format("<p class=\"because\">{}</p>\n<ul>\n{}</ul>\n", heading, items);
}

std::string accuracy_sentence(const View& view) {
  const calib::Calibration& result = view.result;
  if (!is_known(result.predicted_near_targets_m) || !is_known(result.predicted_workspace_m)) {
    return "The 3-D position error was not predicted.";
  }
  const std::string near = fmt::format("Predicted mean 3-D position error: {} near the targets",
                                       mm_words(result.predicted_near_targets_m));
  const std::string far = mm_words(result.predicted_workspace_m);
  const std::string nominal =
      is_known(result.nominal_workspace_u_m)
          ? fmt::format(" With the nominal model of this arm: {} ± {} over the workspace (k = 2).",
                        mm_words(result.nominal_workspace_m),
                        mm_words(result.nominal_workspace_u_m))
          : std::string();
  if (result.verdict.workspace || !result.verdict.publish()) {
    return fmt::format("{}, {} over the workspace (from the covariance).{}", near, far, nominal);
  }
  return fmt::format(
      "{}, {} over the workspace, which is outside of the scope (both from the covariance).{}",
      near, far, nominal);
}

}  // namespace

std::string verdict_banner(const View& view) {
  const calib::Verdict& verdict = view.result.verdict;
  const Reasons reasons = sorted_reasons(verdict);
  std::string words = list(verdict.too_few() ? "What it has shown" : "Why not", reasons.against);
  if (!verdict.publish() && reasons.against.empty()) {
    words = "<p class=\"because\">No reason was recorded.</p>\n";
  }
  words += list(verdict.publish() ? "Before using it" : "Other findings", reasons.other);
  if (!verdict.publish() && !reasons.scope.empty()) {
    words += fmt::format("<p class=\"besides\">Scale: {}.</p>\n", escape(reasons.scope));
  }
  return fmt::format(
      "<div id=\"verdict\" class=\"verdict {}\">\n<span class=\"glyph\" aria-hidden=\"true\">{}"
      "</span>\n<div>\n<p class=\"headline\">{}</p>\n<p class=\"scope\">{}</p>\n{}</div>\n</div>\n",
      verdict.publish()   ? "yes"
      : verdict.too_few() ? "few"
                          : "no",
      verdict.publish() || verdict.too_few() ? "&#10003;" : "&#10005;", headline(verdict),
      scope_words(view, reasons), words);
}

std::string summary(const View& view) {
  return fmt::format("<p class=\"lead\">{} {} {}</p>\n", escape(data_sentence(view)),
                     escape(residual_sentence(view)), escape(accuracy_sentence(view)));
}

// Directions that the touches do not determine, rejected touches, and correlated parameters.

namespace {

constexpr std::string_view kNothing = "\xE2\x80\x93";
constexpr std::size_t kMostPairs = 20;
constexpr std::size_t kMostShares = 6;  // of one direction; the remaining ones are small
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

// For the comparison of two plans of touches.
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
  if (view.result.verdict.too_few()) {
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
