#include "calib/files/priors_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr const char* kPriorsFormat = "cellcal.priors/1";
constexpr std::size_t kMostPriorsBytes = 1u << 20, kMostJoints = 32;
constexpr long kMostArms = 1'000'000, kMostVersions = 1'000'000'000;

struct SpreadRow {
  SpreadUnit unit;
  const char* ending;  ///< unit suffix of the keys
  Range allowed;       ///< same range as in a robot file
};
constexpr EnumTable<SpreadKind, SpreadRow> kSpreads{
    {{SpreadKind::kLength, {{"length", "mm", kMmPerM}, "mm", {1e-9, 1e3}}},
     {SpreadKind::kAngle, {{"angle", "deg", kDegPerRad}, "deg", {1e-9, 90.0}}},
     {SpreadKind::kCompliance, {{"compliance", "rad/(N m)", 1.0}, "rad_per_nm", {1e-20, 1.0}}},
     {SpreadKind::kGear, {{"gear", "arcsec", 1.0 / kRadPerArcsec}, "arcsec", {1e-9, 1e5}}},
     {SpreadKind::kFunction,
      {{"function", "arcsec", 1.0 / kRadPerArcsec}, "arcsec", {1e-9, 1e5}}}}};

struct Keys {
  explicit Keys(const SpreadRow& row)
      : found(fmt::format("{}_{}", row.unit.name, row.ending)),
        sigma(fmt::format("{}_sigma_{}", row.unit.name, row.ending)),
        drawn(fmt::format("{}_drawn_{}", row.unit.name, row.ending)),
        arms(fmt::format("{}_arms", row.unit.name)) {}
  std::string found, sigma, drawn, arms;
};

std::optional<Spread> read_spread(const TomlTable& table, SpreadKind kind, int arms) {
  const SpreadRow row = kSpreads[kind];
  const Keys keys(row);
  if (!table.has(keys.found) && !table.has(keys.sigma) && !table.has(keys.drawn) &&
      !table.has(keys.arms))
    return std::nullopt;
  const Range range = row.allowed;
  const double per_si = row.unit.per_si;
  Spread spread;
  const double found = table.number(keys.found, range);
  spread.found = found / per_si;
  // An uncertainty above three times the value carries no information.
  constexpr double kMostOfFound = 3.0;
  spread.found_sigma = table.number(keys.sigma, {0.0, kMostOfFound * found}) / per_si;
  spread.drawn = table.number(keys.drawn, range) / per_si;
  spread.arms = table.number(keys.arms, {0.0, 2.0 * arms});
  if (offered(spread) * per_si > range.max)
    table.fail(keys.found, "with its uncertainty is beyond what a robot file may state");
  return spread;
}

JointPriors read_joint(const TomlTable& table, int arms) {
  JointPriors joint{table.string("name"), {}, 0.0};
  if (joint.joint.empty()) table.fail("name", "must not be empty");
  for (const SpreadKind kind : kSpreadKinds) joint.of(kind) = read_spread(table, kind, arms);
  if (joint.of(SpreadKind::kFunction))
    joint.function_reach_rad = table.number("function_reach_deg", {0.1, 180.0}) * kRadPerDeg;
  table.refuse_unknown();
  return joint;
}

FleetPriors read(const TomlTable& document) {
  document.word("format", {kPriorsFormat});
  FleetPriors priors;
  priors.version = document.integer("version", 1, kMostVersions);
  priors.made = document.string("made");
  priors.robot = document.string("robot");
  priors.nominal_geometry = document.string("drawing");
  if (!is_sha256(priors.nominal_geometry))
    document.fail("drawing", "must be 64 digits, 0-9 and a-f");
  priors.arms = static_cast<int>(document.integer("arms", 1, kMostArms));
  const auto joints = document.tables("joint");
  if (joints.empty() || joints.size() > kMostJoints)
    document.fail("", fmt::format("priors need 1 to {} [[joint]] tables, but have {}", kMostJoints,
                                  joints.size()));
  std::set<std::string> names;
  for (const TomlTable& table : joints) {
    priors.joints.push_back(read_joint(table, priors.arms));
    if (!names.insert(priors.joints.back().joint).second)
      table.fail("name", "\"" + shown(priors.joints.back().joint) + "\" occurs twice");
  }
  document.refuse_unknown();
  return priors;
}

std::string spread_to_toml(const Spread& spread, SpreadKind kind) {
  const Keys keys(kSpreads[kind]);
  const double per_si = unit_of(kind).per_si;
  return fmt::format("{} = {}\n{} = {}\n{} = {}\n{} = {}\n", keys.found,
                     toml_number(spread.found * per_si), keys.sigma,
                     toml_number(spread.found_sigma * per_si), keys.drawn,
                     toml_number(spread.drawn * per_si), keys.arms, toml_number(spread.arms));
}

}  // namespace

SpreadUnit unit_of(SpreadKind kind) { return kSpreads[kind].unit; }

FleetPriors parse_priors(std::string_view text, const std::string& name) {
  if (text.size() > kMostPriorsBytes)
    throw FileError(
        name, fmt::format(": {} bytes; priors have at most {}", text.size(), kMostPriorsBytes));
  return read(TomlTable::parse(text, name));
}

FleetPriors load_priors(const std::filesystem::path& path) {
  return parse_priors(read_file(path, kMostPriorsBytes), path.string());
}

std::string priors_to_toml(const FleetPriors& priors) {
  std::string out = fmt::format(
      "# 1 sigma of how far the arms of this model lie from their nominal geometry, learned from calibrations. What it means:\n"
      "# 'cellcal priors show FILE'; to use it: 'cellcal priors accept FILE --robot ROBOT -o NEW'.\n"
      "format = \"{}\"\nversion = {}\nmade = {}\nrobot = {}\ndrawing = {}\narms = {}\n",
      kPriorsFormat, priors.version, toml_string(priors.made), toml_string(priors.robot),
      toml_string(priors.nominal_geometry), priors.arms);
  for (const JointPriors& joint : priors.joints) {
    out += fmt::format("\n[[joint]]\nname = {}\n", toml_string(joint.joint));
    for (const SpreadKind kind : kSpreadKinds)
      if (const auto& spread = joint.of(kind)) out += spread_to_toml(*spread, kind);
    if (joint.of(SpreadKind::kFunction))
      out += fmt::format("function_reach_deg = {}\n",
                         toml_number(joint.function_reach_rad * kDegPerRad));
  }
  return out;
}

}  // namespace cellcal::calib
