// Heading of the page: whether, where and why the result may be used.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "calib/result/finding_phrase.h"
#include "calib/result/unidentifiable.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

struct Reasons {
  calib::Phrase scope;  // without its introduction; the first of them
  std::vector<calib::Phrase> against, other;
};

bool is_scope(calib::FindingKind kind) {
  return kind == calib::FindingKind::kScaleByLengths ||
         kind == calib::FindingKind::kScaleByReadings ||
         kind == calib::FindingKind::kScaleByNothing || kind == calib::FindingKind::kScopeOfTouches;
}

Reasons sorted_reasons(const calib::Verdict& verdict) {
  Reasons reasons;
  for (const calib::Finding& one : verdict.findings) {
    if (reasons.scope.empty() && is_scope(one.kind)) {
      reasons.scope = calib::sentence_phrase(one);
    } else {
      const bool note = verdict.publish() || !one.withholds();
      (note ? reasons.other : reasons.against).push_back(calib::phrase(one));
    }
  }
  return reasons;
}
bool nothing_changed(const View& view) {
  return view.result.update && view.result.update->outcome == calib::UpdateOutcome::kNothingChanged;
}

/// Not published, and without a defect.
bool is_as_it_should_be(const View& view) {
  return view.result.verdict.too_few() || nothing_changed(view);
}

std::string scope_words(const View& view, const Reasons& reasons) {
  if (nothing_changed(view)) return say("say.report.verdict.unchanged.scope");
  const calib::Verdict& verdict = view.result.verdict;
  if (verdict.too_few()) return say("say.report.verdict.few.scope");
  if (!verdict.publish()) return say("say.report.verdict.no.scope");
  std::string why = sentence(reasons.scope);
  if (why.empty())
    why = say(verdict.workspace             ? "say.report.verdict.workspace.by_length"
              : view.touched_lengths() == 0 ? "say.report.verdict.near.by_sizes"
                                            : "say.report.verdict.near.elsewhere");
  return say(
      {verdict.workspace ? "say.report.verdict.workspace.scope" : "say.report.verdict.near.scope",
       {{"why", why}}});
}

const char* headline(const View& view) {
  const calib::Verdict& verdict = view.result.verdict;
  if (nothing_changed(view)) return "say.report.verdict.unchanged";
  if (verdict.too_few()) return "say.report.verdict.few";
  if (!verdict.publish()) return "say.report.verdict.no";
  return verdict.workspace ? "say.report.verdict.workspace" : "say.report.verdict.near";
}

std::string data_sentence(const View& view) {
  const std::string check = view.check == 0 ? say("say.report.data.no_check")
                                            : counted(view.check, "say.report.data.check.");
  const std::string outliers =
      view.outliers == 0 ? std::string() : counted(view.outliers, "say.report.data.outliers.");
  return say({view.result.update ? "say.report.data.update" : "say.report.data",
              {{"touches", counted(view.fit, "say.report.touches.")},
               {"targets", target_words(view)},
               {"check", check},
               {"outliers", outliers}}});
}

std::string residual_sentence(const View& view) {
  const calib::Calibration& result = view.result;
  const bool tested = result.check.count > 0;
  const calib::ResidualSummary& after = tested ? result.check : result.after;
  const bool same_touches_before = tested && result.check_before.count > 0;
  const calib::ResidualSummary& before = same_touches_before ? result.check_before : result.before;
  if (after.count <= 0) return say("say.report.residual.none");
  return say({result.update ? "say.report.residual.update"
              : tested      ? "say.report.residual.checked"
                            : "say.report.residual.fitted",
              {{"before", mm_words(before.mean_m)},
               {"before_max", mm_words(before.max_m)},
               {"after", mm_words(after.mean_m)},
               {"after_max", mm_words(after.max_m)}}});
}

std::string list(const char* heading, const std::vector<calib::Phrase>& reasons) {
  if (reasons.empty()) return {};
  std::string items;
  for (const calib::Phrase& reason : reasons)
    items += fmt::format("<li>{}</li>\n", escape(say(reason)));
  return paragraph("because", say(heading)) + fmt::format("<ul>\n{}</ul>\n", items);
}

std::string accuracy_sentence(const View& view) {
  const calib::Calibration& result = view.result;
  if (!is_known(result.predicted_near_targets_m) || !is_known(result.predicted_workspace_m))
    return say("say.report.accuracy.none");
  const bool in_scope = result.verdict.workspace || !result.verdict.publish();
  const std::string predicted =
      say({in_scope ? "say.report.accuracy" : "say.report.accuracy.outside",
           {{"near", mm_words(result.predicted_near_targets_m)},
            {"far", mm_words(result.predicted_workspace_m)}}});
  if (!is_known(result.nominal_workspace_u_m)) return predicted;
  return predicted + say({"say.report.accuracy.nominal",
                          {{"far", mm_words(result.nominal_workspace_m)},
                           {"u", mm_words(result.nominal_workspace_u_m)}}});
}

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

void add_row(const View& view, const calib::Outlier& outlier, Table& table) {
  std::string target = kDash, line = kDash;
  if (outlier.touch < view.input.touches.size()) {
    const calib::Touch& touch = view.input.touches[outlier.touch];
    target = escape(touch.target);
    if (touch.line > 0) line = fmt::format("{}", touch.line);
  }
  const std::string reason = say(calib::phrase(outlier));
  table.row({std::to_string(outlier.touch + 1), line, target, signed_mm(outlier.residual_m),
             reason.empty() ? say("say.report.outliers.no_reason") : escape(reason)});
}

// For the comparison of two plans of touches.
std::string observability_words(const calib::Observability& o) {
  if (o.rows <= 0) return {};
  const auto number = [](double value) { return significant(value, 3); };
  return fmt::format(
      "<p id=\"observability\">{}</p>\n",
      say({"say.report.observability",
           {{"directions", counted(static_cast<std::size_t>(std::max(0, o.directions)),
                                   "say.report.observability.directions.")},
            {"rank", o.rank},
            {"determined", o.determined},
            {"o1", number(o.o1)},
            {"o2", number(o.o2)},
            {"o3", number(o.o3)},
            {"o4", number(o.o4)},
            {"o5", number(o.o5)},
            {"condition", number(o.condition)}}}));
}

}  // namespace

std::string verdict_banner(const View& view) {
  const calib::Verdict& verdict = view.result.verdict;
  const Reasons reasons = sorted_reasons(verdict);
  std::string words =
      list(is_as_it_should_be(view) ? "say.report.shown" : "say.report.why_not", reasons.against);
  if (!verdict.publish() && reasons.against.empty()) {
    words = paragraph("because", say("say.report.no_reason"));
  }
  words += list(verdict.publish() ? "say.report.before_use" : "say.report.other_findings",
                reasons.other);
  if (!verdict.publish() && !reasons.scope.empty()) {
    words +=
        paragraph("besides", say({"say.report.scale", {{"words", escape(say(reasons.scope))}}}));
  }
  return fmt::format(
      "<div id=\"verdict\" class=\"verdict {}\">\n<span class=\"glyph\" aria-hidden=\"true\">{}"
      "</span>\n<div>\n<p class=\"headline\">{}</p>\n<p class=\"scope\">{}</p>\n{}</div>\n</div>\n",
      verdict.publish()          ? "yes"
      : is_as_it_should_be(view) ? "few"
                                 : "no",
      verdict.publish() || is_as_it_should_be(view) ? "&#10003;" : "&#10005;", say(headline(view)),
      scope_words(view, reasons), words);
}

std::string summary(const View& view) {
  return fmt::format("<p class=\"lead\">{} {} {}</p>\n", escape(data_sentence(view)),
                     escape(residual_sentence(view)), escape(accuracy_sentence(view)));
}

// Directions that the touches do not determine, rejected touches, and correlated parameters.

std::string unidentifiable(const View& view) {
  constexpr const char* kHeading = "say.report.unidentifiable";
  const auto& directions = view.result.unidentifiable;
  if (view.result.verdict.too_few())
    return section("unidentifiable", kHeading, paragraph("", say("say.report.unidentifiable.few")));
  if (directions.empty())
    return section("unidentifiable", kHeading,
                   paragraph("", say(view.result.observability.rows > 0
                                         ? "say.report.unidentifiable.none"
                                         : "say.report.unidentifiable.not_examined")) +
                       observability_words(view.result.observability));
  std::string items;
  for (const calib::UnidentifiableDirection& direction : directions) {
    const std::string shares = shares_of(view, direction);
    items +=
        fmt::format("<li>{}{}</li>\n", escape(say(calib::phrase(view.result.cell, direction))),
                    shares.empty() ? std::string() : fmt::format("<br><small>{}</small>", shares));
  }
  return section("unidentifiable", kHeading,
                 paragraph("", counted(directions.size(), "say.report.unidentifiable.")) +
                     fmt::format("<ol>\n{}</ol>\n", items) +
                     observability_words(view.result.observability));
}

std::string outliers(const View& view) {
  const auto& list = view.result.outliers;
  if (list.empty())
    return section("outliers", "say.report.outliers",
                   paragraph("", say("say.report.outliers.none")));
  Table table({"say.report.col.touch",
               "say.report.col.line",
               {"say.report.col.target", "word"},
               "say.report.col.residual_mm",
               {"say.report.col.reason", "word wide"}});
  for (const calib::Outlier& outlier : list) add_row(view, outlier, table);
  return section("outliers", "say.report.outliers",
                 paragraph("", say("say.report.outliers.note")) + table.html());
}

std::string correlations(const View& view) {
  constexpr const char* kHeading = "say.report.correlations";
  const calib::Correlations strong = calib::strong_correlations(view.result);
  if (!strong.available)
    return section("correlations", kHeading, paragraph("", say("say.report.correlations.unknown")));
  const std::string frame = say(strong.frame_removed ? "say.report.correlations.frame_fixed"
                                                     : "say.report.correlations.frame_included");
  const std::size_t of_frame = strong.of_targets_or_frame;
  const std::string left_out =
      of_frame == 0 ? std::string()
                    : paragraph("note", counted(of_frame, "say.report.correlations.left_out."));
  const std::string limit = fixed(calib::kStrongCorrelation, 1);
  if (strong.pairs.empty())
    return section(
        "correlations", kHeading,
        paragraph("", frame + say({"say.report.correlations.none", {{"limit", limit}}})) +
            left_out);
  Table table(
      {"say.report.col.parameter", {"say.report.col.and", "word"}, "say.report.col.correlation"},
      "narrow");
  const std::size_t shown = std::min(strong.pairs.size(), kMostPairs);
  const auto parameter = [&](std::size_t index) {
    return "<code>" + escape(name_of(view, view.result.parameters[index])) + "</code>";
  };
  for (std::size_t i = 0; i < shown; ++i) {
    const calib::CorrelatedPair& pair = strong.pairs[i];
    table.row({parameter(pair.first), parameter(pair.second),
               signed_fixed(pair.correlation, kCorrelationDecimals)});
  }
  std::string body =
      paragraph("", frame + say({"say.report.correlations.note", {{"limit", limit}}})) +
      table.html();
  if (strong.pairs.size() > shown)
    body += paragraph("note", say({"say.report.correlations.strongest",
                                   {{"shown", shown}, {"of", strong.pairs.size()}}}));
  return section("correlations", kHeading, body + left_out);
}

}  // namespace cellcal::daemon::report
