#include "daemon/cli/offline.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <ranges>
#include <stdexcept>

#include "calib/estimate/seed_paper.h"
#include "calib/export/corrector.h"
#include "calib/export/krl_text.h"
#include "calib/export/tables.h"
#include "calib/files/calibration_json.h"
#include "calib/files/cell_file.h"
#include "calib/files/csv.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/robot_file.h"
#include "calib/files/toml.h"
#include "calib/files/touches.h"
#include "calib/identify/identify.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "calib/result/finding_phrase.h"
#include "calib/result/unidentifiable.h"
#include "calib/verdict/change.h"
#include "daemon/cli/commands.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using calib::kMmPerM;

std::string line(const char* id, const calib::ResidualSummary& summary) {
  const std::string name = fmt::format("{:<14}", say(id));
  if (summary.count == 0) return said({"say.cli.residual.none", {{"name", name}}});
  return said({"say.cli.residual",
               {{"name", name},
                {"n", summary.count},
                {"mean", summary.mean_m * kMmPerM},
                {"max", summary.max_m * kMmPerM},
                {"rms", summary.rms_m * kMmPerM}}});
}

const char* verdict_id(const calib::Calibration& calibration) {
  const calib::Verdict& verdict = calibration.verdict;
  if (calibration.update && calibration.update->outcome == calib::UpdateOutcome::kNothingChanged)
    return "say.cli.verdict.nothing_changed";
  if (verdict.too_few()) return "say.cli.verdict.too_few";
  if (verdict.publish())
    return verdict.workspace ? "say.cli.verdict.workspace" : "say.cli.verdict.near";
  return verdict.workspace ? "say.cli.verdict.not.workspace" : "say.cli.verdict.not.near";
}

std::string verdict_words(const calib::Calibration& calibration, Detail detail) {
  std::string text = said(verdict_id(calibration));
  for (const calib::Finding& finding : calibration.verdict.findings) {
    // A change of the arm is of interest in every result.
    if (detail == Detail::kAll || finding.severity != calib::Severity::kInforms ||
        finding.kind == calib::FindingKind::kUnchanged ||
        finding.kind == calib::FindingKind::kUpdated)
      text += "  - " + said(calib::phrase(finding));
  }
  return text;
}

std::string observability_words(const calib::Observability& o) {
  if (o.rows == 0) return {};
  return said({"say.cli.observability",
               {{"determined", o.determined},
                {"directions", o.directions},
                {"rank", o.rank},
                {"o1", o.o1},
                {"o2", o.o2},
                {"o3", o.o3},
                {"o4", o.o4},
                {"o5", o.o5},
                {"condition", o.condition}}});
}

/// The most correlated pairs of parameters.
std::string correlation_words(const calib::Calibration& calibration) {
  constexpr std::size_t kShown = 3;
  const auto pairs = calib::strong_correlations(calibration).pairs;
  if (pairs.empty()) return {};
  const auto name = [&](std::size_t index) {
    return calib::parameter_name(calibration.cell, calibration.parameters[index].key);
  };
  calib::Phrase list;
  for (std::size_t i = 0; i < std::min(kShown, pairs.size()); ++i)
    list = joined("say.join.comma", list,
                  {"say.cli.correlated.pair",
                   {{"a", name(pairs[i].first)},
                    {"b", name(pairs[i].second)},
                    {"by", pairs[i].correlation}}});
  if (pairs.size() > kShown)
    list =
        joined("say.join.semicolon", list,
               {pairs.size() == kShown + 1 ? "say.cli.correlated.one" : "say.cli.correlated.more",
                {{"n", pairs.size() - kShown}, {"beyond", calib::kStrongCorrelation}}});
  return said({"say.cli.correlated", {{"pairs", list}}});
}

/// "touch 12 (line 14)"
calib::Phrase touch_phrase(std::size_t index, std::span<const calib::Touch> touches) {
  const std::size_t line = index < touches.size() ? touches[index].line : 0;
  return {line > 0 ? "say.touch.line" : "say.touch", {{"n", index + 1}, {"line", line}}};
}

/// Numbers and lines of the rejected touches, as one line of the summary.
std::string outlier_list(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches) {
  constexpr std::size_t kShown = 6;
  const std::size_t count = calibration.outliers.size();
  if (count == 0) return {};
  calib::Phrase list;
  for (std::size_t i = 0; i < std::min(kShown, count); ++i)
    list = joined("say.join.comma", list, touch_phrase(calibration.outliers[i].touch, touches));
  if (count > kShown) list = joined("say.join.comma", list, "...");
  return said({count == 1 ? "say.cli.outliers.one" : "say.cli.outliers",
               {{"n", count}, {"touches", list}}});
}

/// Parts of the arm's model that the touches gave evidence for.
std::string model_words(const calib::Calibration& c) {
  const bool by_level = c.level_reason.choice == calib::LevelChoice::kMeanByEvidence ||
                        c.level_reason.choice == calib::LevelChoice::kAskedFor;
  return by_level ? said({"say.cli.model", {{"model", phrase(c.cell, c.level)}}}) : "";
}

/// Axes of the positioner, one per line.
std::string positioner_words(const calib::Calibration& c) {
  std::string text;
  for (const calib::PositionerLine& line : c.positioner) {
    const Eigen::Vector3d point_mm = line.point_m * kMmPerM;
    text += said({"say.cli.positioner",
                  {{"axis", line.axis},
                   {"x", point_mm.x()},
                   {"y", point_mm.y()},
                   {"z", point_mm.z()},
                   {"dx", line.direction.x()},
                   {"dy", line.direction.y()},
                   {"dz", line.direction.z()},
                   {"u", line.place_u95_m * kMmPerM},
                   {"turn", line.direction_u95_rad * 1e3}}});
  }
  return text;
}

std::string predicted_words(const calib::Calibration& c) {
  if (!(c.predicted_workspace_m > 0.0)) return {};
  std::string text = said({"say.cli.predicted",
                           {{"near", c.predicted_near_targets_m * kMmPerM},
                            {"over", c.predicted_workspace_m * kMmPerM}}});
  if (c.nominal_workspace_u_m > 0.0)
    text += said({"say.cli.predicted.nominal",
                  {{"near", c.nominal_near_targets_m * kMmPerM},
                   {"near_u", c.nominal_near_targets_u_m * kMmPerM},
                   {"over", c.nominal_workspace_m * kMmPerM},
                   {"over_u", c.nominal_workspace_u_m * kMmPerM}}});
  return text;
}

std::string fit_words(const calib::Calibration& c) {
  std::string text;
  if (c.degrees_of_freedom > 0.0)
    text += said({"say.cli.chi2",
                  {{"chi2", c.chi2}, {"dof", c.degrees_of_freedom}, {"per", c.chi2_per_dof}}});
  if (c.repeats.degrees_of_freedom > 0.0)
    text += said({"say.cli.noise",
                  {{"stated", c.cell.touch_sigma_m * kMmPerM},
                   {"measured", c.repeats.scatter_m * kMmPerM},
                   {"touches", c.repeats.touches},
                   {"dof", c.repeats.degrees_of_freedom},
                   {"used", c.repeats.used_m * kMmPerM}}});
  return text;
}

/// Details of the summary.
std::string evidence_words(const calib::Calibration& c, std::span<const calib::Touch> touches,
                           const std::optional<ContactsDelay>& contacts) {
  std::string text = fit_words(c) + delay_words(&c, contacts) +
                     observability_words(c.observability) + correlation_words(c);
  for (const calib::UnidentifiableDirection& direction : c.unidentifiable)
    text += said({"say.cli.not_identifiable", {{"words", calib::phrase(c.cell, direction)}}});
  // The phrase of an outlier includes its residual.
  for (const calib::Outlier& one : c.outliers)
    text += said({"say.cli.outlier",
                  {{"touch", touch_phrase(one.touch, touches)}, {"words", calib::phrase(one)}}});
  return text;
}

calib::InputFile input(const char* role, const std::string& name, const std::string& text) {
  return {role, name, calib::sha256(text)};
}

/// Keeps symbolic links, and writes through pipes and devices. Refuses a file that the command has read or
/// written, which would be lost.
void write_output(const std::filesystem::path& output, const std::string& text) {
  namespace fs = std::filesystem;
  const std::string& name = output.native();
  std::error_code ignored;
  const fs::file_status status = fs::status(output, ignored);
  if (name.starts_with("/dev/") || name.starts_with("/proc/") ||
      (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status))) {
    std::ofstream stream(output, std::ios::binary);
    if (!(stream << text << std::flush))
      throw std::runtime_error(name + ": cannot be written. Choose another file");
    return;
  }
  constexpr int kMostLinks = 40;
  fs::path file = output;
  for (int k = 0; k < kMostLinks && fs::is_symlink(file); ++k)
    file = file.parent_path() / fs::read_symlink(file);
  require_output_folder(file);
  if (const auto used = calib::UsedFiles::of(file))
    throw std::runtime_error(name +
                             (*used == calib::UsedFiles::As::kRead
                                  ? " is an input of this command. Choose another file"
                                  : " is another output of this command. Choose another file"));
  write_atomically(file, text);
  calib::UsedFiles::note(file, calib::UsedFiles::As::kWritten);
}

/// The touches are already made: faults of the cell file are only warnings.
void warn_of_cell(const calib::Cell& cell) {
  try {
    for (const calib::CellFault& fault : calib::faults_of(cell))
      if (fault.kind != calib::CellFaultKind::kRoughCentre) warn(phrase(fault));
  } catch (const calib::PlanError&) {  // of a robot that sessions cannot move
  }
}

std::string withheld_words(const std::string& command, const std::filesystem::path& calibration,
                           const calib::Verdict& verdict) {
  std::string words =
      said({"say.cli.withheld", {{"command", command}, {"file", calibration.string()}}});
  for (const calib::Finding& reason : verdict.findings)
    words += "  - " + said(calib::phrase(reason));
  return words;
}

}  // namespace

std::string delay_words(const calib::Calibration* fit,
                        const std::optional<ContactsDelay>& contacts) {
  const calib::ParameterResult* found =
      fit == nullptr ? nullptr : calib::find(*fit, calib::latch_delay_parameter());
  // A value determined by the prior alone is not a finding of the fit.
  if (found != nullptr && found->decided_by != calib::DecidedBy::kData) found = nullptr;
  if (found == nullptr && !contacts) return {};
  const auto in_ms = [](double delay_s, double sigma_s) {
    return calib::Phrase("say.cli.delay.ms",
                         {{"ms", calib::kMsPerS * delay_s}, {"u", calib::kMsPerS * 2.0 * sigma_s}});
  };
  calib::Phrase by_contacts, by_fit;
  if (contacts)
    by_contacts = {
        "say.cli.delay.contacts",
        {{"delay", in_ms(contacts->delay_s, contacts->sigma_s)}, {"touches", contacts->touches}}};
  if (found == nullptr) return said({"say.cli.delay", {{"what", by_contacts}}});
  const double fit_s = found->nominal + found->correction;
  by_fit = {"say.cli.delay.fit", {{"delay", in_ms(fit_s, found->sigma)}}};
  if (!contacts) return said({"say.cli.delay", {{"what", by_fit}}});
  const bool one =
      std::abs(fit_s - contacts->delay_s) <= 2.0 * std::hypot(found->sigma, contacts->sigma_s);
  return said({one ? "say.cli.delay.agree" : "say.cli.delay.disagree",
               {{"fit", by_fit}, {"contacts", by_contacts}}});
}

std::string result_words(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches, Detail detail,
                         const std::optional<ContactsDelay>& contacts) {
  const bool too_few = calibration.verdict.too_few();
  const std::string verdict = verdict_words(calibration, detail);
  // With one or two touches per target the fit's residuals are negligible in any case.
  if (too_few && calibration.check.count == 0) return delay_words(nullptr, contacts) + verdict;
  std::string text = said("say.cli.residual.head");
  text += line("say.cli.residual.fit.before", calibration.before);
  // The nominal arm's, where the estimate has left it.
  if (calibration.level_reason.choice == calib::LevelChoice::kNothingIdentified)
    return text + verdict;
  text += line("say.cli.residual.fit.after", calibration.after);
  text += line("say.cli.residual.check.before", calibration.check_before);
  text += line("say.cli.residual.check.after", calibration.check);
  if (too_few) return text + delay_words(nullptr, contacts) + verdict;
  text += model_words(calibration) + predicted_words(calibration) + positioner_words(calibration);
  text += detail == Detail::kAll ? evidence_words(calibration, touches, contacts)
                                 : outlier_list(calibration, touches);
  return text + verdict;
}

void require_output_folder(const std::filesystem::path& output) {
  const std::filesystem::path folder = std::filesystem::absolute(output).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw std::runtime_error(
        fmt::format("folder {} does not exist. Create it, or choose another", folder.string()));
  if (std::filesystem::is_directory(output))
    throw std::runtime_error(output.string() + " is a folder. Give a file in it");
  if (::access(folder.c_str(), W_OK) != 0)
    throw std::runtime_error(fmt::format(
        "cannot write into {}: {}. {}", folder.string(), std::strerror(errno),
        errno == EACCES ? "Use sudo, or choose another folder" : "Choose another folder"));
}

void report_reading(const std::filesystem::path& csv, const calib::Robot& robot) {
  calib::CsvTable table(calib::read_file(csv), csv.string(), "");
  calib::take_for_joints(table, robot);
  if (!table.reading().empty())
    fmt::print(stderr, "{}: read as {}\n", csv.string(), table.reading());
}

/// Reports readings that count as one touch, on standard error.
static void report_stands(const std::filesystem::path& csv,
                          const std::vector<calib::Touch>& touches) {
  int readings = 0;
  for (const calib::Touch& touch : touches) readings += std::max(1, touch.readings);
  const auto postures = static_cast<int>(touches.size());
  if (readings > postures)
    fmt::print(stderr, "{}",
               said({"say.cli.stands",
                     {{"file", csv.string()}, {"n", readings}, {"postures", postures}}}));
}

void warn_of_radians(const std::filesystem::path& csv, const calib::Robot& robot,
                     std::span<const calib::JointVector> rows) {
  constexpr std::size_t kFewestRows = 5;
  double largest_deg = 0.0;
  for (const calib::JointVector& row : rows)
    for (std::size_t i = robot.first_turning(); i < row.size(); ++i)
      largest_deg = std::max(largest_deg, std::abs(row[i]) * calib::kDegPerRad);
  if (rows.size() < kFewestRows || largest_deg == 0.0 || largest_deg > calib::kRadPerTurn) return;
  warn({"say.cli.radians", {{"file", csv.string()}, {"largest", largest_deg}, {"n", rows.size()}}});
}

void put(const std::string& text, const std::filesystem::path& output) {
  if (!output.empty()) {
    write_output(output, text);
    return;
  }
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    if (errno == EPIPE) return;  // the reader has closed the pipe: `| head`
    throw std::runtime_error("standard output cannot be written");
  }
}

std::string json_text(const nlohmann::json& value) {
  return value.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

int print_result(bool as_json, const nlohmann::json& value, const std::string& words) {
  put(as_json ? value.dump() + "\n" : words, {});
  return kSuccess;
}

int identify(const IdentifyCommand& command) {
  const calib::CellText files = calib::read_cell_text(command.cell);
  const calib::Cell cell = calib::parse_cell(files);
  warn_of_cell(cell);
  const std::string csv = calib::read_file(command.touches);
  const std::vector<calib::Touch> touches =
      calib::parse_touches(csv, command.touches.string(), cell);
  if (touches.empty())
    throw calib::FileError(command.touches.string(), ": no row after the header");
  report_reading(command.touches, cell.robot);
  report_stands(command.touches, touches);
  calib::Calibration calibration = command.method == "paper"
                                       ? calib::identify_paper(cell, touches)
                                       : calib::identify(cell, touches,
                                                         {.region_poses = calib::kStatedPoses,
                                                          .functions = command.method != "plain"},
                                                         calib::shipped_robots);
  calibration.inputs = {input("cell", files.cell_name, files.cell_text),
                        input("robot", files.robot_name, files.robot_text),
                        input("touches", command.touches.string(), csv)};
  if (!command.last.empty()) {
    const std::string last = calib::read_file(command.last);
    calib::judge_change(calib::calibration_from_json(last, command.last.string()),
                        command.last.filename().string(), command.accept_change, touches,
                        calibration);
    calibration.inputs.push_back(input("last", command.last.string(), last));
  }
  const std::string json = calib::calibration_to_json(calibration);
  if (!command.output.empty()) put_as(calib::calibration_from_json, json, command.output);
  if (command.json) {
    put(json, {});
  } else if (command.verbose) {
    put(result_words(calibration, touches, Detail::kAll), {});
  } else {
    put(result_words(calibration, touches) + said("say.cli.identify.verbose"), {});
  }
  return calibration.verdict.publish() ? kSuccess : kNotPublishable;
}

calib::Calibration read_calibration(const std::filesystem::path& file) {
  const std::string text = calib::read_file(file);
  calib::Calibration calibration = calib::calibration_from_json(text, file.string());
  if (!calib::states_sum(text))
    fmt::print(
        stderr,
        "warning: {}: has no sum: written by an earlier version, or taken out. A changed value "
        "does not show. Compare it with its session: 'cellcal export ID DIR'\n",
        file.string());
  return calibration;
}

void refuse_far(const calib::Calibration& calibration, const std::filesystem::path& file) {
  if (const auto far = calib::far_correction(calibration))
    throw calib::FileError(
        file.string(),
        fmt::format(": {}: not of this arm, or altered. Take the file from its session again: "
                    "'cellcal export ID DIR'",
                    calib::words(*far)));
}

std::optional<calib::Calibration> usable_calibration(const std::string& command,
                                                     const std::filesystem::path& file,
                                                     bool withheld) {
  calib::Calibration calibration = read_calibration(file);
  if (!calibration.verdict.publish() && !withheld) {
    fmt::print(stderr, "{}", withheld_words(command, file, calibration.verdict));
    return std::nullopt;
  }
  // A large correction may be the reason for withholding, which the user has accepted.
  if (calibration.verdict.publish()) refuse_far(calibration, file);
  return calibration;
}

void as_robot(const std::string& text, const std::string& name) {
  calib::read_robot(calib::TomlTable::parse(text, name));
}

void as_krl(const std::string& text, const std::string& name) {
  calib::krl::read_lines({name, text});
}

void read_back(const std::string& text, const std::filesystem::path& output, const Reader& reader) {
  const std::string name = output.empty() ? "standard output" : output.string();
  try {
    reader(text, name);
  } catch (const calib::FileError& error) {
    throw calib::FileError(std::string(error.what()) +
                           " (cellcal could not read this file again: not written)");
  }
}

void put_as(const Reader& reader, const std::string& text, const std::filesystem::path& output) {
  read_back(text, output, reader);
  put(text, output);
}

}  // namespace cellcal::daemon
