#include "calib/files/calibration_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/files/json_fields.h"
#include "calib/files/result_fields.h"
#include "calib/files/toml.h"
#include "calib/model/units.h"
#include "calib/result/level.h"
#include "calib/result/unidentifiable.h"

namespace cellcal::calib {

namespace {

using fields::Field, fields::Json, fields::Table, fields::Value, fields::field, fields::for_readers,
    fields::list, fields::maybe, fields::named, fields::not_negative, fields::number,
    fields::object, fields::only_of, fields::text, fields::vector, fields::where, fields::whole;

/// One row of the kind whose amount has this unit.
Field<Explanation> amount(const char* key, ChangeKind kind, double per) {
  return only_of<Explanation>([=](const Explanation& one) { return one.kind == kind; },
                              field(key, &Explanation::amount, number(per)));
}

Field<Explanation> sigma(const char* key, bool (*those)(const Explanation&), double per) {
  return only_of<Explanation>(those, field(key, &Explanation::sigma, not_negative(per)));
}

Table<Explanation> explanation_fields() {
  using E = Explanation;
  const auto of_touch = [](const E& one) { return one.kind == ChangeKind::kTouch; };
  const auto shifted = [](const E& one) { return is_shift(one.kind); };
  const auto known_partly = [](const E& one) {
    return (one.kind == ChangeKind::kTool || one.kind == ChangeKind::kSphere) && one.amount > 0.0;
  };
  return {
      field("kind", &E::kind, named<ChangeKind>("is not known")),
      field("name", &E::name, text()),
      field("probability", &E::probability, not_negative()),
      field("log_likelihood", &E::log_likelihood, number()),
      only_of<E>(of_touch, field("touch", &E::touch, whole<std::size_t>())),
      only_of<E>(shifted, field("shift_mm", &E::shift_m, vector(kMmPerM))),
      where<E>(known_partly, field("at_least_mm", &E::amount, not_negative(kMmPerM))),
      amount("angle_deg", ChangeKind::kJoint, kDegPerRad),
      amount("growth_ppm", ChangeKind::kGrowth, kPerMillion),
      amount("off_mm", ChangeKind::kTouch, kMmPerM),
      amount("turn_deg", ChangeKind::kPositioner, kDegPerRad),
      sigma(
          "sigma_mm",
          [](const E& one) { return is_shift(one.kind) || one.kind == ChangeKind::kTouch; },
          kMmPerM),
      sigma(
          "sigma_deg", [](const E& one) { return one.kind == ChangeKind::kJoint; }, kDegPerRad),
      sigma(
          "sigma_ppm", [](const E& one) { return one.kind == ChangeKind::kGrowth; }, kPerMillion),
      only_of<E>([](const E& one) { return one.kind == ChangeKind::kPositioner; },
                 field("turn_sigma_deg", &E::turn_sigma, not_negative(kDegPerRad))),
      for_readers<E>("words", [](const E& one) -> Json { return words(one); })};
}

/// Origin of an updated calibration.
Table<UpdateOrigin> update_fields() {
  using U = UpdateOrigin;
  return {field("outcome", &U::outcome, named<UpdateOutcome>("is not known")),
          field("stands_on", &U::stands_on, text()),
          field("months", &U::months, not_negative()),
          field("touches", &U::touches, whole<std::size_t>()),
          field("set_aside", &U::set_aside, list(whole<std::size_t>())),
          field("not_found", &U::not_found, list(text())),
          field("explanations", &U::explanations, list(object(explanation_fields()))),
          field("chi2", &U::chi2, not_negative()),
          field("degrees_of_freedom", &U::degrees_of_freedom, not_negative()),
          field("by_chance", &U::by_chance, not_negative()),
          field("log_odds_second", &U::log_odds_second, number()),
          maybe("second", &U::second, object(explanation_fields())),
          field("m3_before_mm", &U::before_m, not_negative(kMmPerM)),
          field("m3_reached_mm", &U::reached_m, not_negative(kMmPerM)),
          where<U>([](const U& u) { return u.on_positioner; },
                   {"on_positioner", [](const U&) { return Json(true); },
                    [](const JsonReader& r, U& u) { u.on_positioner = r.flag(); }})};
}

using fields::beside, fields::from_json, fields::group, fields::joined, fields::of_member,
    fields::optional, fields::to_json;
using C = Calibration;

constexpr const char* kFormat = "cellcal.calibration/1";

void require_format(const JsonReader& r, C&) {
  if (r.text() != kFormat)
    r.fail("must be \"" + std::string(kFormat) +
           "\"; this is another kind of file or a newer version");
}

TomlTable document(const JsonReader& r) { return table_from_json(r.object(), r.where()); }

Field<C> robot_field() {
  return {"robot", [](const C& c) -> Json { return toml_to_json(robot_to_toml(c.cell.robot)); },
          [](const JsonReader& r, C& c) { c.cell.robot = read_robot(document(r)); }};
}

Field<C> cell_field() {
  return {
      "cell",
      [](const C& c) -> Json { return toml_to_json(cell_to_toml(c.cell, c.cell.robot.name)); },
      [](const JsonReader& r, C& c) { c.cell = read_cell(document(r), std::move(c.cell.robot)); }};
}

/// A member whose rows depend on the cell, which was read before.
template <class V>
Field<C> of_cell(const char* key, V C::*member, Value<V> (*as)(const Cell&)) {
  return {key, [=](const C& c) { return as(c.cell).to(c.*member); },
          [=](const JsonReader& r, C& c) { c.*member = as(c.cell).from(r); }};
}

/// Derived from covariance and frame_basis, for readers without linear algebra.
Json correlations_json(const C& c) {
  Json out = Json::array();
  for (const CorrelatedPair& pair : strong_correlations(c).pairs) {
    constexpr double kDigits = 1e4;  // the covariance's last bit would change more digits
    out.push_back({{"a", parameter_name(c.cell, c.parameters[pair.first].key)},
                   {"b", parameter_name(c.cell, c.parameters[pair.second].key)},
                   {"value", std::round(pair.correlation * kDigits) / kDigits}});
  }
  return out;
}

/// Table of each joint function over the touched angles, for other programs.
Json joint_functions_json(const C& c) {
  const auto scaled = [](const std::vector<double>& values, double factor) {
    Json out = Json::array();
    for (const double value : values) out.push_back(value * factor);
    return out;
  };
  Json out = Json::array();
  for (const JointFunction& f : joint_functions(c))
    out.push_back({{"joint", c.cell.robot.joints[f.joint].name},
                   {"angle_deg", scaled(f.angle_rad, kDegPerRad)},
                   {"error_arcsec", scaled(f.error_rad, 1.0 / kRadPerArcsec)},
                   {"u95_arcsec", scaled(f.u95_rad, 1.0 / kRadPerArcsec)}});
  return out;
}

Field<C> joint_functions_field() {
  const auto any = [](const C& c) {
    return std::ranges::any_of(c.parameters,
                               [](const ParameterResult& p) { return is_function(p.key.kind); });
  };
  return where<C>(any, for_readers<C>("joint_functions", joint_functions_json));
}

/// Files without typed reasons hold text only.
Field<C> reason_field() {
  return {"reason", [](const C& c) -> Json { return level_and_reason_words(c); },
          [](const JsonReader& r, C& c) {
            c.level_reason.text = r.text();
            if (!c.level_reason.text.empty()) c.level_reason.choice = LevelChoice::kRecorded;
          }};
}

/// Choice of the level; known kinds are worded anew.
Field<C> chosen_field() {
  const auto is_kind = [](LevelChoice choice) {
    return choice != LevelChoice::kNone && choice != LevelChoice::kRecorded;
  };
  return where<C>([=](const C& c) { return is_kind(c.level_reason.choice); },
                  {"chosen", [](const C& c) -> Json { return own_name(c.level_reason.choice); },
                   [=](const JsonReader& r, C& c) {
                     const auto choice = by_own_name<LevelChoice>(r.text());
                     if (choice && is_kind(*choice)) c.level_reason = {*choice};
                   }});
}

Field<C> model_field() {
  return group("model", joined(of_member(&C::level, level_fields()),
                               {reason_field(), chosen_field(),
                                field("considered", &C::levels, list(object(evidence_fields())))}));
}

Field<C> residuals_field() {
  const auto summary = object(summary_fields());
  return group<C>("residuals",
                  {field("before", &C::before, summary), field("after", &C::after, summary),
                   field("check", &C::check, summary),
                   optional(field("check_before", &C::check_before, summary))});
}

Field<C> predicted_field() {
  const auto mm = number(kMmPerM), nominal_mm = not_negative(kMmPerM);
  const auto known = [](const C& c) { return c.nominal_workspace_m > 0.0; };
  const auto sure = [](const C& c) { return c.nominal_workspace_u_m > 0.0; };
  return group<C>(
      "predicted",
      {field("m2_mm", &C::predicted_near_targets_m, mm),
       field("m3_mm", &C::predicted_workspace_m, mm),
       where<C>(known, beside("nominal_m3_mm",
                              field("nominal_m2_mm", &C::nominal_near_targets_m, nominal_mm))),
       where<C>(known, field("nominal_m3_mm", &C::nominal_workspace_m, nominal_mm)),
       where<C>(sure, beside("nominal_m3_u_mm",
                             field("nominal_m2_u_mm", &C::nominal_near_targets_u_m, nominal_mm))),
       where<C>(sure, field("nominal_m3_u_mm", &C::nominal_workspace_u_m, nominal_mm))});
}

/// Postures as the controller shows them, in degrees, of a linear unit in mm.
Field<C> region_field() {
  const auto unit = [](const C& c, std::size_t joint) {
    return c.cell.robot.joints[joint].is_prismatic() ? kMmPerM : kDegPerRad;
  };
  return group<C>("region", {{"postures",
                              [=](const C& c) {
                                Json all = Json::array();
                                for (const JointVector& q : c.region) {
                                  Json& one = all.emplace_back(Json::array());
                                  for (std::size_t i = 0; i < q.size(); ++i)
                                    one.push_back(q[i] * unit(c, i));
                                }
                                return all;
                              },
                              [=](const JsonReader& r, C& c) {
                                for (const JsonReader& posture : r.items()) {
                                  const auto values = posture.items();
                                  if (values.size() != c.cell.robot.joints.size())
                                    posture.fail("must have a value per joint of the robot");
                                  JointVector& q = c.region.emplace_back();
                                  for (const JsonReader& value : values)
                                    q.push_back(value.number() / unit(c, q.size()));
                                }
                              }}});
}

Field<C> touch_noise_field() {
  return group<C>("touch_noise",
                  joined({for_readers<C>("stated_mm",
                                         [](const C& c) { return c.cell.touch_sigma_m * kMmPerM; }),
                          for_readers<C>("from_residuals_mm",
                                         [](const C& c) { return c.touch_noise_m * kMmPerM; })},
                         of_member(&C::repeats, repeats_fields())));
}

Field<C> inputs_field() {
  return group<C>("inputs",
                  {for_readers<C>("software", [](const C&) { return software_version(); }),
                   field("files", &C::inputs, list(object(input_fields())))});
}

/// All rows of the file, in order.
Table<C> calibration_fields() {
  const auto with_observability = [](const C& c) { return c.observability.rows > 0; };
  const auto with_discrepancy = [](const C& c) {
    return c.discrepancy.sigma_m > 0.0 || c.discrepancy.estimated;
  };
  return {
      {"format", [](const C&) { return kFormat; }, require_format},
      optional(field("method", &C::method, text())),
      robot_field(),
      cell_field(),
      optional(model_field()),
      parameters_field(),
      joint_functions_field(),
      of_cell(
          "targets", &C::targets,
          +[](const Cell& cell) { return list(object(target_fields(cell))); }),
      where<C>([](const C& c) { return !c.positioner.empty(); },
               field("positioner", &C::positioner, list(object(positioner_fields())))),
      maybe("linear_unit", &C::linear_unit, object(linear_unit_fields())),
      residuals_field(),
      of_cell(
          "unidentifiable", &C::unidentifiable,
          +[](const Cell& cell) { return list(object(unidentifiable_fields(cell))); }),
      where<C>(with_observability,
               field("observability", &C::observability, object(observability_fields()))),
      for_readers<C>("correlations", correlations_json),
      predicted_field(),
      where<C>([](const C& c) { return !c.uncertainty.empty(); },
               field("uncertainty", &C::uncertainty, list(object(uncertainty_fields())))),
      where<C>([](const C& c) { return !c.region.empty(); }, region_field()),
      where<C>([](const C& c) { return !c.touched_loads.empty(); },
               field("touched_loads", &C::touched_loads, list(text()))),
      where<C>(with_discrepancy,
               field("discrepancy", &C::discrepancy, object(discrepancy_fields()))),
      optional(field("chi2", &C::chi2, not_negative())),
      optional(field("degrees_of_freedom", &C::degrees_of_freedom, not_negative())),
      optional(field("chi2_per_dof", &C::chi2_per_dof, number())),
      optional(field("touch_noise_mm", &C::touch_noise_m, number(kMmPerM))),
      optional(touch_noise_field()),
      of_cell(
          "verdict", &C::verdict, +[](const Cell& cell) { return object(verdict_fields(cell)); }),
      field("outliers", &C::outliers, list(object(outlier_fields()))),
      optional(field("lengths", &C::lengths, list(object(length_fields())))),
      optional(field("moved", &C::moved, list(object(moved_fields())))),
      optional(field("jumped", &C::jumped, list(object(jump_fields())))),
      covariance_field(),
      frame_basis_field(),
      maybe("update", &C::update, object(update_fields())),
      inputs_field(),
  };
}

constexpr const char* kSum = "sum";

/// Canonical form: the sum does not depend on key order, whitespace, or 1 for 1.0.
nlohmann::json as_read(nlohmann::json value) {
  if (value.is_number()) value = value.get<double>() + 0.0;  // -0.0 becomes 0.0
  if (value.is_structured())
    for (nlohmann::json& one : value) one = as_read(std::move(one));
  return value;
}

/// SHA-256 of the whole document except the sum itself.
std::string sum_of(const nlohmann::json& document) { return sha256(write_json(as_read(document))); }

/// Removed after successful verification.
void extract_sum(nlohmann::json& document, const std::string& name) {
  if (!document.is_object() || document.value("format", nlohmann::json()) != kFormat) return;
  const auto found = document.find(kSum);
  if (found == document.end()) return;  // file of an earlier version
  const nlohmann::json stated = *found;
  document.erase(found);
  if (stated != sum_of(document))
    throw FileError(name,
                    ": sum: not that of its content: damaged or altered since it was written. Take "
                    "the file from its session again: 'cellcal export ID DIR'");
}

}  // namespace

std::string software_version() { return CELLCAL_VERSION; }

std::string calibration_to_json(const Calibration& c) {
  Json document = to_json(calibration_fields(), c);
  document[kSum] = sum_of(parse_json(write_lines(document)));
  return write_lines(document);
}

bool states_sum(std::string_view calibration) {
  const nlohmann::json document = parse_json(calibration);
  return document.is_object() && document.contains(kSum);
}

Calibration calibration_from_json(std::string_view text, const std::string& name) {
  refuse_deep_json(text, name);
  nlohmann::json document = parse_json(text);
  if (document.is_discarded())
    throw FileError(name,
                    ": not valid JSON: cut off, or no calibration (calibration.json of a session)");
  extract_sum(document, name);
  Calibration c;
  from_json(calibration_fields(), JsonReader(document, name), c);
  return c;
}

Calibration load_calibration(const std::filesystem::path& path) {
  return calibration_from_json(read_file(path), path.string());
}

}  // namespace cellcal::calib
