// Command cellcal relate: where the base of one arm is in that of another that touched the same spheres.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/check/base_relation.h"
#include "calib/files/cell_file.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/units.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

namespace {

using calib::kDegPerRad;
using calib::kMmPerM;
using calib::SpherePair;
using nlohmann::json;

struct RelateCommand {
  std::filesystem::path first, second, output;
  std::vector<std::string> same;  ///< "S1=K1"
  std::vector<std::filesystem::path>
      cells;  ///< of the first and of the second arm; their serial numbers
  bool json = false;
};

/// Serial numbers by target id.
using Serials = std::map<std::string, std::string>;

Serials serials_of(const std::filesystem::path& cell) {
  const auto document =
      calib::TomlTable::parse(calib::read_file(cell, calib::kMostTomlBytes), cell.string());
  Serials serials, owners;
  for (const calib::TomlTable& target : document.tables("target")) {
    const std::string serial = target.string_or("serial", ""), id = target.string("id");
    if (serial.empty()) continue;
    if (const auto [owner, is_new] = owners.emplace(serial, id); !is_new)
      target.fail("serial", fmt::format("\"{}\" is that of {}, too. Correct one of them",
                                        calib::shown(serial), calib::shown(owner->second)));
    serials[id] = serial;
  }
  return serials;
}

std::vector<std::string> spheres_of(const calib::Calibration& calibration) {
  std::vector<std::string> ids;
  for (const calib::TargetResult& target : calibration.targets)
    if (target.kind == calib::TargetKind::kSphere) ids.push_back(target.id);
  return ids;
}

std::string serial_of(const Serials& serials, const std::string& id) {
  const auto found = serials.find(id);
  return found == serials.end() ? "" : found->second;
}

/// By serial number where both cell files state one, otherwise by name.
std::vector<SpherePair> same_spheres(const RelateCommand& command, const calib::Calibration& first,
                                     const calib::Calibration& second) {
  std::vector<SpherePair> pairs;
  for (const std::string& one : command.same) {
    const auto at = one.find('=');
    pairs.push_back({one.substr(0, at), one.substr(at + 1)});
  }
  if (!pairs.empty()) return pairs;
  Serials one, other;
  if (!command.cells.empty()) {
    one = serials_of(command.cells[0]);
    other = serials_of(command.cells[1]);
  }
  const std::vector<std::string> candidates = spheres_of(second);
  for (const std::string& id : spheres_of(first)) {
    const std::string serial = serial_of(one, id);
    const auto found = std::ranges::find_if(candidates, [&](const std::string& candidate) {
      const std::string its = serial_of(other, candidate);
      return serial.empty() || its.empty() ? candidate == id : its == serial;
    });
    if (found != candidates.end()) pairs.push_back({id, *found});
  }
  return pairs;
}

double u_mm(const Eigen::Matrix3d& covariance) {
  return 2.0 * std::sqrt(covariance.trace()) * kMmPerM;
}

json three(const Eigen::Vector3d& v, double unit) {
  return {v.x() * unit, v.y() * unit, v.z() * unit};
}

json json_of(const calib::BaseRelation& found) {
  const calib::FrameMmDeg frame = calib::to_frame(found.second_in_first);
  const Eigen::Vector<double, 6> u = 2.0 * found.covariance.diagonal().cwiseSqrt();
  json spheres = json::array();
  for (const calib::RelatedSphere& one : found.spheres)
    spheres.push_back({{"first", one.sphere.first},
                       {"second", one.sphere.second},
                       {"agrees", one.agrees},
                       {"suspect", one.suspect},
                       {"off_mm", three(one.off_m, kMmPerM)},
                       {"distance_mm", one.off_m.norm() * kMmPerM},
                       {"u_mm", one.u_m * kMmPerM},
                       {"sigmas", one.sigmas}});
  return {{"second_in_first", {{"xyz_mm", frame.xyz_mm}, {"abc_deg", frame.abc_deg}}},
          {"u_xyz_mm", three(u.head<3>(), kMmPerM)},
          {"u_rotation_deg", three(u.tail<3>(), kDegPerRad)},
          {"middle_mm", three(found.middle_m, kMmPerM)},
          {"u_middle_mm", u_mm(found.middle_covariance)},
          {"chi2", found.chi2},
          {"degrees_of_freedom", found.degrees_of_freedom},
          {"agrees", found.agrees()},
          {"spheres", spheres}};
}

std::string name_of(const SpherePair& pair) {
  return calib::shown(pair.first == pair.second ? pair.first : pair.first + "=" + pair.second);
}

std::string words_of(const calib::RelatedSphere& one) {
  const char* id = !one.agrees   ? "say.relate.sphere.moved"
                   : one.suspect ? "say.relate.sphere.suspect"
                                 : "say.relate.sphere";
  return said({id,
               {{"name", fmt::format("{:<10}", name_of(one.sphere))},
                {"off", one.off_m.norm() * kMmPerM},
                {"u", one.u_m * kMmPerM},
                {"sigmas", one.sigmas}}});
}

/// As $ROBROOT: in the controller's syntax, with decimal points.
std::string krl_frame(calib::FrameMmDeg f) {
  // Below the printed digits: no "-0.0000".
  for (double& mm : f.xyz_mm) mm = std::abs(mm) < 0.5e-4 ? 0.0 : mm;
  for (double& deg : f.abc_deg) deg = std::abs(deg) < 0.5e-5 ? 0.0 : deg;
  return fmt::format("{{X {:.4f},Y {:.4f},Z {:.4f},A {:.5f},B {:.5f},C {:.5f}}}\n", f.xyz_mm[0],
                     f.xyz_mm[1], f.xyz_mm[2], f.abc_deg[0], f.abc_deg[1], f.abc_deg[2]);
}

std::string report(const calib::BaseRelation& found) {
  const Eigen::Vector<double, 6> u = 2.0 * found.covariance.diagonal().cwiseSqrt();
  std::string text =
      said("say.relate.frame") + krl_frame(calib::to_frame(found.second_in_first)) +
      said({"say.relate.u",
            {{"x", u[0] * kMmPerM},
             {"y", u[1] * kMmPerM},
             {"z", u[2] * kMmPerM},
             {"about_x", u[3] * kDegPerRad},
             {"about_y", u[4] * kDegPerRad},
             {"about_z", u[5] * kDegPerRad},
             {"middle", u_mm(found.middle_covariance)}}}) +
      said({"say.relate.spheres", {{"chi2", found.chi2}, {"dof", found.degrees_of_freedom}}});
  for (const calib::RelatedSphere& one : found.spheres) text += words_of(one);
  if (std::ranges::any_of(found.spheres, &calib::RelatedSphere::suspect))
    text += said("say.relate.contradiction");
  return text;
}

int relate(const RelateCommand& command) {
  const auto first = usable_calibration("relate", command.first, false);
  if (!first) return kNotPublishable;
  const auto second = usable_calibration("relate", command.second, false);
  if (!second) return kNotPublishable;
  const calib::BaseRelation found =
      calib::relate_bases(*first, *second, same_spheres(command, *first, *second));
  put(command.json ? json_of(found).dump(1) + "\n" : report(found), command.output);
  return found.agrees() ? kSuccess : kNotPublishable;
}

std::string no_pair(std::string& text) {
  const auto at = text.find('=');
  return at == std::string::npos || at == 0 || at + 1 == text.size()
             ? "\"" + text + "\" is not like S1=K1"
             : "";
}

}  // namespace

void add_relate(CLI::App& app, int& status) {
  const auto [command, given] = add_command(app, status, "relate", relate);
  command->add_option("first", given->first)->required();
  command->add_option("second", given->second)->required();
  CLI::Option* same = command->add_option("--same", given->same)
                          ->delimiter(',')
                          ->check(CLI::Validator(no_pair, "ID=ID"));
  command->add_option("--cells", given->cells)->expected(2)->excludes(same);
  add_output(*command, given->output);
  add_json(*command, given->json);
  add_language(*command);
}

}  // namespace cellcal::daemon
