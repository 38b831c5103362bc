#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/files/calibration_json.h"
#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/files/priors_file.h"
#include "calib/files/robot_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/error.h"
#include "calib/model/iso_time.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using calib::FileError, nlohmann::ordered_json;

constexpr std::size_t kMostFiles = 20'000, kMostPriorsBytes = std::size_t{64} << 20;
constexpr const char* kExport = "export.json";

/// JSON files below a directory; of the export of a session its calibration only.
void files_below(const fs::path& directory, std::set<fs::path>& files) {
  std::set<fs::path> found;
  // Inaccessible entries (dangling links, foreign folders) are skipped.
  std::error_code none;
  fs::recursive_directory_iterator at(directory, fs::directory_options::skip_permission_denied,
                                      none);
  for (; !none && at != fs::recursive_directory_iterator(); at.increment(none)) {
    std::error_code odd;
    if (at->path().extension() != ".json" || !at->is_regular_file(odd) || odd) continue;
    found.insert(at->path());
    if (found.size() > kMostFiles)
      throw FileError(
          directory.string(),
          fmt::format(": more than {} JSON files. Name directories of calibrations", kMostFiles));
  }
  for (const fs::path& file : found)
    if (!found.contains(file.parent_path() / kExport) || file.filename() == "calibration.json")
      files.insert(file);
}

/// Each file once, however often it is named.
std::set<fs::path> calibrations_of(const std::vector<fs::path>& from) {
  std::set<fs::path> files, once;
  for (const fs::path& path : from)
    if (fs::is_directory(path))
      files_below(path, files);
    else
      files.insert(path);
  std::set<fs::path> known;
  for (const fs::path& file : files)
    if (known.insert(fs::weakly_canonical(file)).second) once.insert(file);
  return once;
}

/// Arm and time stated by the surrounding export; unchanged outside of an export.
void name_arm(const fs::path& file, calib::ArmEvidence& evidence) {
  const fs::path folder = file.parent_path();
  if (file.filename() != "calibration.json" || !fs::exists(folder / kExport)) return;
  const auto manifest = calib::parse_json(calib::read_file(folder / kExport, kMostPriorsBytes));
  if (manifest.is_object() && manifest.contains("started") && manifest["started"].is_string())
    evidence.time = manifest["started"];
  try {
    evidence.arm = calib::TomlTable::load(folder / "cell.toml")
                       .table_or_empty("identity")
                       .string_or("robot_serial", "");
  } catch (const FileError&) {  // then the touches have to identify the arm
  }
}

struct Read {
  std::vector<calib::ArmEvidence> arms;
  std::vector<calib::SetAside> set_aside;
};

void read_one(const fs::path& file, Read& read) {
  try {
    const calib::Calibration c =
        calib::calibration_from_json(calib::read_file(file, kMostPriorsBytes), file.string());
    auto evidence = calib::evidence_of(c);
    if (const auto* why = std::get_if<calib::SetAsideKind>(&evidence)) {
      read.set_aside.push_back({file.string(), *why});
      return;
    }
    auto& arm = std::get<calib::ArmEvidence>(evidence);
    arm.name = file.string();
    name_arm(file, arm);
    read.arms.push_back(std::move(arm));
  } catch (const FileError& error) {
    read.set_aside.push_back({file.string(), calib::SetAsideKind::kUnreadable, error.what()});
  }
}

std::string now() {
  using std::chrono::system_clock, std::chrono::seconds;
  return calib::utc_text(std::chrono::floor<seconds>(system_clock::now()));
}

/// The next version number.
long next_version(const fs::path& after, const std::string& nominal_geometry) {
  if (after.empty()) return 1;
  const calib::FleetPriors earlier = calib::load_priors(after);
  if (earlier.nominal_geometry != nominal_geometry)
    throw FileError(
        after.string(),
        fmt::format(": priors of another nominal geometry ({}). Name earlier priors of this model",
                    earlier.robot));
  return earlier.version + 1;
}

ordered_json as_json(const std::vector<calib::SetAside>& all) {
  ordered_json list = ordered_json::array();
  for (const calib::SetAside& one : all) {
    ordered_json item{{"file", one.name}, {"kind", to_string(one.kind)}};
    if (one.kind == calib::SetAsideKind::kSameArm) item["as"] = one.other;
    if (one.directions > 0) {
      item["chi2"] = one.chi2;
      item["directions"] = one.directions;
    }
    item["words"] = set_aside_words(one);
    list.push_back(std::move(item));
  }
  return list;
}

ordered_json as_json(const calib::FleetPriors& priors) {
  return calib::toml_to_json(calib::priors_to_toml(priors));
}

void print_json(const ordered_json& json) {
  put(json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n", {});
}

ordered_json as_json(const std::vector<calib::PriorChange>& changes) {
  ordered_json list = ordered_json::array();
  for (const calib::PriorChange& one : changes) {
    const calib::SpreadUnit unit = calib::unit_of(one.kind);
    ordered_json item{{"joint", one.joint}, {"of", unit.name}, {"unit", unit.unit}};
    if (one.before > 0.0) item["old"] = one.before * unit.per_si;
    item["new"] = one.after * unit.per_si;
    list.push_back(std::move(item));
  }
  return list;
}

/// To standard output where no document is written to it.
void print_report(bool document_there, const std::string& text) {
  fmt::print(document_there ? stderr : stdout, "{}", text);
}

/// "a joint's lengths" for a table.
std::string quantity(calib::SpreadKind kind) {
  const calib::SpreadUnit unit = calib::unit_of(kind);
  return fmt::format("{} {}", unit.name, unit.unit);
}

std::string figure(double value) { return fmt::format("{:.4g}", value); }

}  // namespace

int learn_priors(const LearnPriorsCommand& command) {
  Read read;
  for (const fs::path& file : calibrations_of(command.from)) read_one(file, read);
  calib::Learned learned;
  if (!command.robot.empty())
    learned = calib::learn(calib::load_named_robot(command.robot), read.arms);
  else if (!read.arms.empty())
    learned = calib::learn(calib::commonest_nominal_geometry(read.arms), read.arms);
  else
    learned.none = calib::NoPriors::kTooFewArms;
  learned.set_aside.insert(learned.set_aside.end(), read.set_aside.begin(), read.set_aside.end());
  std::ranges::sort(learned.set_aside, {}, &calib::SetAside::name);
  if (!learned.none) {
    learned.priors.version = next_version(command.after, learned.priors.nominal_geometry);
    learned.priors.made = now();
  }
  std::string report;
  for (const calib::SetAside& one : learned.set_aside)
    report += "set aside: " + set_aside_words(one) + "\n";
  if (command.json)
    print_json({{"priors", learned.none ? ordered_json(nullptr) : as_json(learned.priors)},
                {"set_aside", as_json(learned.set_aside)}});
  if (learned.none) {
    fmt::print(stderr, "cellcal priors learn: {}\n{}", no_priors_words(learned), report);
    return kJobFailed;
  }
  if (!command.json || !command.output.empty())
    put_as(calib::parse_priors, calib::priors_to_toml(learned.priors), command.output);
  if (!command.json) print_report(command.output.empty(), spreads_words(learned.priors) + report);
  return kSuccess;
}

int show_priors(const ShowPriorsCommand& command) {
  const calib::FleetPriors priors = calib::load_priors(command.file);
  if (command.json)
    print_json(as_json(priors));
  else
    put(spreads_words(priors), {});
  return kSuccess;
}

int accept_priors(const AcceptPriorsCommand& command) {
  const calib::FleetPriors priors = calib::load_priors(command.file);
  if (fs::exists(command.robot) && fs::exists(command.output) &&
      fs::equivalent(command.robot, command.output))
    throw FileError(
        command.output.string(),
        ": is the robot file itself. Choose another file, so that the old values are kept");
  if (fs::exists(command.output))
    throw FileError(command.output.string(),
                    ": exists. Choose another file, so that its content is kept");
  const calib::Robot robot = calib::load_named_robot(command.robot);
  auto result = calib::accept(robot, priors);
  if (const auto* other = std::get_if<calib::OtherNominalGeometry>(&result))
    throw FileError(
        command.file.string(),
        fmt::format(
            ": priors of {}, nominal geometry {:.12}; {} has {:.12}. Use priors learned from this model",
            priors.robot, other->priors, robot.name, other->robot));
  auto& accepted = std::get<calib::Accepted>(result);
  accepted.robot.source +=
      fmt::format("{}tolerances: fleet priors version {} of {} arms, {}",
                  robot.source.empty() ? "" : "; ", priors.version, priors.arms, priors.made);
  put_as(as_robot, calib::robot_to_toml(accepted.robot), command.output);
  if (command.json) {
    print_json({{"robot", command.output.string()}, {"changes", as_json(accepted.changes)}});
    return kSuccess;
  }
  // A relative path in a cell file is relative to that file.
  const fs::path written = fs::absolute(command.output).lexically_normal();
  put(fmt::format("{}{}: written. In the cell file: robot = {}\n", changes_words(accepted.changes),
                  command.output.string(), calib::toml_string(written.string())),
      {});
  return kSuccess;
}

std::string spreads_words(const calib::FleetPriors& priors) {
  std::string text = fmt::format(
      "priors of {}, version {}, made {}, {} arms\nnominal geometry {}\n"
      "{:<8} {:<22} {:>10} {:>10} {:>10} {:>10} {:>7}\n",
      calib::shown(priors.robot, 80), priors.version, calib::shown(priors.made), priors.arms,
      priors.nominal_geometry, "joint", "1 sigma of", "drawn", "found", "+-", "offered", "arms");
  for (const calib::JointPriors& joint : priors.joints)
    for (const calib::SpreadKind kind : calib::kSpreadKinds)
      if (const auto& s = joint.of(kind)) {
        const double per_si = calib::unit_of(kind).per_si;
        text += fmt::format("{:<8} {:<22} {:>10} {:>10} {:>10} {:>10} {:>7.1f}\n",
                            calib::shown(joint.joint), quantity(kind), figure(s->drawn * per_si),
                            figure(s->found * per_si), figure(s->found_sigma * per_si),
                            figure(calib::offered(*s) * per_si), s->arms);
      }
  return text +
         "arms: effective number of arms, 1: one arm measured without error.\noffered: found, "
         "widened by its uncertainty; below 4 arms at least the drawn value\n";
}

std::string changes_words(const std::vector<calib::PriorChange>& changes) {
  std::string text = fmt::format("{:<8} {:<22} {:>10} {:>10} {:>8}\n", "joint", "1 sigma of", "old",
                                 "new", "change");
  for (const calib::PriorChange& one : changes) {
    const double per_si = calib::unit_of(one.kind).per_si;
    text += fmt::format(
        "{:<8} {:<22} {:>10} {:>10} {:>8}\n", one.joint, quantity(one.kind),
        one.before > 0.0 ? figure(one.before * per_si) : "assumed", figure(one.after * per_si),
        one.before > 0.0 ? fmt::format("{:+.0f} %", 100.0 * (one.after / one.before - 1.0)) : "");
  }
  return text;
}

std::string set_aside_words(const calib::SetAside& one) {
  constexpr std::size_t kWhole = 400;  // a path and an error text
  const std::string name = calib::shown(one.name, kWhole), other = calib::shown(one.other, kWhole);
  using calib::SetAsideKind;
  switch (one.kind) {
    case SetAsideKind::kUnreadable: return fmt::format("{}: cannot be read. {}", name, other);
    case SetAsideKind::kWithheld:
      return name + ": withheld, not used. Priors are learned from published calibrations";
    case SetAsideKind::kOtherNominalGeometry:
      return name + ": nominal geometry of another robot model. Learn its priors separately";
    case SetAsideKind::kInconsistent:
      return name + ": parameters and covariance are inconsistent. Replay its session";
    case SetAsideKind::kUninformative:
      return name + ": determined by the prior alone. It needs more touches";
    case SetAsideKind::kSameArm:
      return fmt::format("{}: same arm as {}. Only that one is used", name, other);
    case SetAsideKind::kTooFar:
      return fmt::format(
          "{}: chi^2 {:.3g} for {} directions, farther from nominal than the other arms. Check "
          "robot file and mastering of this arm",
          name, one.chi2, one.directions);
    case SetAsideKind::kTooNear:
      return fmt::format(
          "{}: chi^2 {:.3g} for {} directions, too small to be measured errors. Check the source "
          "of this calibration",
          name, one.chi2, one.directions);
  }
  return name;
}

std::string no_priors_words(const calib::Learned& learned) {
  if (learned.none == calib::NoPriors::kTooFewArms)
    return fmt::format(
        "{} arms; priors need {}. Add published calibrations of other arms of the model",
        learned.priors.arms, calib::kFewestArms);
  return fmt::format(
      "{} arms fit, more than 20 % of all do not: not one population. Check the arms set aside; "
      "learn each kind of arm separately",
      learned.priors.arms);
}

}  // namespace cellcal::daemon
