#include "calib/files/calibration_json.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/files/documents.h"
#include "calib/files/files.h"
#include "calib/files/finding_json.h"
#include "calib/files/outlier_json.h"
#include "calib/files/unidentifiable_json.h"
#include "calib/linear/cholesky.h"
#include "calib/model/units.h"
#include "calib/result/correlation.h"
#include "calib/result/finding_words.h"
#include "calib/result/nominal_value.h"
#include "calib/syntax/input_file.h"
#include "calib/syntax/json_reader.h"
#include "calib/syntax/json_text.h"
#include "calib/syntax/nesting.h"
#include "calib/syntax/shown.h"
#include "calib/syntax/toml_json.h"

namespace cellcal::calib {

namespace {

using nlohmann::json;
using Reader = JsonReader;
using ordered = nlohmann::ordered_json;

constexpr const char* kFormat = "cellcal.calibration/1";

ordered summary_json(const ResidualSummary& s) {
  return {{"mean_mm", s.mean_m * kMmPerM},
          {"max_mm", s.max_m * kMmPerM},
          {"rms_mm", s.rms_m * kMmPerM},
          {"count", s.count}};
}

ordered vector_mm(const Eigen::Vector3d& v) {
  return {v.x() * kMmPerM, v.y() * kMmPerM, v.z() * kMmPerM};
}

ordered target_json(const TargetResult& t) {
  ordered entry = {{"id", t.id},
                   {"centre_mm", vector_mm(t.centre_m)},
                   {"effective_radius_mm", t.effective_radius_m * kMmPerM}};
  if (t.kind == TargetKind::kPlane) {
    entry["normal"] = {t.normal.x(), t.normal.y(), t.normal.z()};
    entry["distance_mm"] = t.distance_m * kMmPerM;
  }
  if (t.kind == TargetKind::kTracker) {
    const FrameMmDeg frame = to_frame(t.frame);
    entry["frame"] = {{"xyz_mm", frame.xyz_mm}, {"abc_deg", frame.abc_deg}};
  }
  return entry;
}

ResidualSummary read_summary(const Reader& r) {
  ResidualSummary s;
  s.mean_m = r.at("mean_mm").number() / kMmPerM;
  s.max_m = r.at("max_mm").number() / kMmPerM;
  s.rms_m = r.at("rms_mm").number() / kMmPerM;
  if (r.has("count")) s.count = static_cast<int>(r.at("count").whole());
  return s;
}

std::array<double, 3> read_three(const Reader& r) {
  const auto items = r.items();
  if (items.size() != 3) r.fail("must hold three numbers");
  return {items[0].number(), items[1].number(), items[2].number()};
}

Eigen::Vector3d read_vector_mm(const Reader& r) {
  const auto mm = read_three(r);
  return Eigen::Vector3d(mm[0], mm[1], mm[2]) / kMmPerM;
}

LengthResult read_length(const Reader& item) {
  const std::vector<Reader> between = item.at("between").items();
  if (between.size() != 2) item.at("between").fail("must name two targets");
  return {between[0].text(),
          between[1].text(),
          item.at("certified_mm").not_negative() / kMmPerM,
          item.at("certified_sigma_mm").not_negative() / kMmPerM,
          item.at("by_others_mm").number() / kMmPerM,
          item.at("by_others_sigma_mm").not_negative() / kMmPerM};
}

TargetResult read_target(const Reader& r, const Cell& cell) {
  TargetResult t;
  t.id = r.at("id").text();
  t.centre_m = read_vector_mm(r.at("centre_mm"));
  t.effective_radius_m = r.at("effective_radius_mm").number() / kMmPerM;
  for (const Target& target : cell.targets)
    if (target.id == t.id) t.kind = target.kind;
  if (t.kind == TargetKind::kPlane) {
    const auto n = read_three(r.at("normal"));
    t.normal = Eigen::Vector3d(n[0], n[1], n[2]);
    constexpr double kUnit = 1e-6;
    if (!(std::abs(t.normal.norm() - 1.0) < kUnit)) r.at("normal").fail("must have length 1");
    t.distance_m = r.at("distance_mm").number() / kMmPerM;
  }
  if (t.kind == TargetKind::kTracker)
    t.frame = to_isometry(
        {read_three(r.at("frame").at("xyz_mm")), read_three(r.at("frame").at("abc_deg"))});
  return t;
}

ordered observability_json(const Observability& o) {
  return {{"rows", o.rows},
          {"unknowns", o.unknowns},
          {"directions", o.directions},
          {"rank", o.rank},
          {"told", o.determined},
          {"o1", o.o1},
          {"o2", o.o2},
          {"o3", o.o3},
          {"o4", o.o4},
          {"o5", o.o5},
          {"condition", o.condition},
          {"singular_values", o.singular_values}};
}

Observability read_observability(const Reader& r) {
  Observability o;
  o.rows = static_cast<int>(r.at("rows").whole());
  o.unknowns = static_cast<int>(r.at("unknowns").whole());
  o.directions = static_cast<int>(r.at("directions").whole());
  o.rank = static_cast<int>(r.at("rank").whole());
  o.determined = static_cast<int>(r.at("told").whole());
  o.o1 = r.at("o1").not_negative();
  o.o2 = r.at("o2").not_negative();
  o.o3 = r.at("o3").not_negative();
  o.o4 = r.at("o4").not_negative();
  o.o5 = r.at("o5").not_negative();
  o.condition = r.at("condition").not_negative();
  for (const Reader& s : r.at("singular_values").items())
    o.singular_values.push_back(s.not_negative());
  return o;
}

/// Whether the bounds that come of it will be real numbers.
bool is_covariance(const Eigen::MatrixXd& m) {
  if (m.size() == 0) return true;     // of no parameters
  constexpr double kRounding = 1e-9;  // of correlations
  const Eigen::VectorXd sigma = m.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd scale = (sigma.array() > 0.0).select(sigma, 1.0).cwiseInverse();
  Eigen::MatrixXd correlation = scale.asDiagonal() * m * scale.asDiagonal();
  if (!correlation.allFinite() || m.diagonal().minCoeff() < 0.0) return false;
  if ((correlation - correlation.transpose()).cwiseAbs().maxCoeff() > kRounding) return false;
  correlation.diagonal().array() += kRounding;
  return Cholesky(correlation).positive();
}

/// Files of before findings hold their words alone.
void read_findings(const Reader& item, Verdict& verdict) {
  for (const Reader& reason : item.at("reasons").items()) {
    Finding recorded{FindingKind::kRecorded,
                     verdict.publish ? Severity::kInforms : Severity::kWithholds};
    recorded.text = reason.text();
    verdict.findings.push_back(std::move(recorded));
  }
  if (!item.has("findings")) return;
  verdict.findings.clear();
  for (const Reader& one : item.at("findings").items())
    verdict.findings.push_back(finding_from_json(one));
}

}  // namespace

std::string software_version() { return CELLCAL_VERSION; }

std::string calibration_to_json(const Calibration& c) {
  ordered out;
  out["format"] = kFormat;
  out["method"] = c.method;
  out["robot"] = parse_ordered_json(toml_to_json(robot_to_toml(c.cell.robot)));
  out["cell"] = parse_ordered_json(toml_to_json(cell_to_toml(c.cell, c.cell.robot.name)));
  const auto level_json = [](const ModelLevel& level) {
    ordered entry{{"compliance", level.compliance},
                  {"transmission", level.transmission},
                  {"ripple_arcsec", level.ripple_rad / kRadPerArcsec}};
    if (level.play > 0.0) entry["play"] = level.play;
    return entry;
  };
  out["model"] = level_json(c.level);
  out["model"]["reason"] = c.level_reason;
  out["model"]["considered"] = ordered::array();
  for (const LevelEvidence& l : c.levels) {
    ordered entry = level_json(l.level);
    entry["log_evidence"] = l.log_evidence;
    entry["probability"] = l.probability;
    out["model"]["considered"].push_back(std::move(entry));
  }
  out["parameters"] = ordered::array();
  for (const ParameterResult& p : c.parameters) {
    out["parameters"].push_back({{"name", parameter_name(c.cell, p.key)},
                                 {"unit", p.unit},
                                 {"nominal", (stated_value(c.cell, p.key) + p.nominal) * p.to_unit},
                                 {"correction", p.correction * p.to_unit},
                                 {"sigma", p.sigma * p.to_unit},
                                 {"decided_by", to_string(p.decided_by)}});
  }
  out["targets"] = ordered::array();
  for (const TargetResult& t : c.targets) out["targets"].push_back(target_json(t));
  out["residuals"] = {{"before", summary_json(c.before)},
                      {"after", summary_json(c.after)},
                      {"check", summary_json(c.check)},
                      {"check_before", summary_json(c.check_before)}};
  out["unidentifiable"] = ordered::array();
  for (const UnidentifiableDirection& d : c.unidentifiable)
    out["unidentifiable"].push_back(unidentifiable_to_json(c.cell, d));
  if (c.observability.rows > 0) out["observability"] = observability_json(c.observability);
  // Worked out from covariance and frame_basis, for readers without linear algebra; not read back.
  out["correlations"] = ordered::array();
  for (const CorrelatedPair& pair : strong_correlations(c).pairs) {
    constexpr double kDigits = 1e4;  // more would change with the last bit of the covariance
    out["correlations"].push_back({{"a", parameter_name(c.cell, c.parameters[pair.first].key)},
                                   {"b", parameter_name(c.cell, c.parameters[pair.second].key)},
                                   {"value", std::round(pair.correlation * kDigits) / kDigits}});
  }
  out["predicted"] = {{"m2_mm", c.predicted_near_targets_m * kMmPerM},
                      {"m3_mm", c.predicted_workspace_m * kMmPerM}};
  if (c.nominal_workspace_m > 0.0) {
    out["predicted"]["nominal_m2_mm"] = c.nominal_near_targets_m * kMmPerM;
    out["predicted"]["nominal_m3_mm"] = c.nominal_workspace_m * kMmPerM;
  }
  if (const Discrepancy& d = c.discrepancy; d.sigma_m > 0.0 || d.estimated)
    out["discrepancy"] = {{"sigma_mm", d.sigma_m * kMmPerM},
                          {"reach_deg", d.reach_rad * kDegPerRad},
                          {"noise_mm", d.noise_m * kMmPerM},
                          {"estimated", d.estimated}};
  out["chi2"] = c.chi2;
  out["degrees_of_freedom"] = c.degrees_of_freedom;
  out["chi2_per_dof"] = c.chi2_per_dof;
  out["touch_noise_mm"] = c.touch_noise_m * kMmPerM;
  ordered noise = {{"stated_mm", c.cell.touch_sigma_m * kMmPerM},
                   {"from_residuals_mm", c.touch_noise_m * kMmPerM}};
  if (c.repeats.degrees_of_freedom > 0.0) {
    noise["from_repeats_mm"] = c.repeats.scatter_m * kMmPerM;
    noise["repeats_degrees_of_freedom"] = c.repeats.degrees_of_freedom;
  }
  if (c.repeats.used_m > 0.0) {
    noise["repeated_touches"] = c.repeats.touches;
    noise["used_mm"] = c.repeats.used_m * kMmPerM;
  }
  out["touch_noise"] = std::move(noise);
  out["verdict"] = {{"publish", c.verdict.publish},
                    {"scope", c.verdict.workspace ? "workspace" : "near targets"},
                    {"reasons", words(c.verdict.findings)},
                    {"findings", ordered::array()}};
  for (const Finding& one : c.verdict.findings)
    out["verdict"]["findings"].push_back(finding_to_json(one));
  if (c.verdict.too_few) out["verdict"]["too_few_touches"] = true;
  out["outliers"] = ordered::array();
  for (const Outlier& o : c.outliers) out["outliers"].push_back(outlier_to_json(o));
  out["lengths"] = ordered::array();
  for (const LengthResult& l : c.lengths)
    out["lengths"].push_back({{"between", {l.from, l.to}},
                              {"certified_mm", l.certified_m * kMmPerM},
                              {"certified_sigma_mm", l.certified_sigma_m * kMmPerM},
                              {"by_others_mm", l.by_others_m * kMmPerM},
                              {"by_others_sigma_mm", l.sigma_m * kMmPerM}});
  out["moved"] = ordered::array();
  for (const MovedTarget& m : c.moved)
    out["moved"].push_back({{"target", m.target},
                            {"after_touch", m.after_touch},
                            {"shift_mm", vector_mm(m.shift_m)},
                            {"sigma_mm", m.sigma_m * kMmPerM},
                            {"squared_sigmas", m.squared_sigmas}});
  out["jumped"] = ordered::array();
  for (const Jump& j : c.jumped) {
    const bool joint = j.what == Jump::What::kJoint;
    ordered item{{"what", to_string(j.what)}, {"name", j.name}, {"after_touch", j.after_touch}};
    if (joint) {
      item["angle_deg"] = j.angle_rad * kDegPerRad;
      item["sigma_deg"] = j.sigma * kDegPerRad;
    } else {
      item["shift_mm"] = vector_mm(j.shift_m);
      item["sigma_mm"] = j.sigma * kMmPerM;
    }
    item["squared_sigmas"] = j.squared_sigmas;
    item["log_odds"] = j.log_odds;
    out["jumped"].push_back(std::move(item));
  }
  // In the parameters' own units, in their order; the frame as columns of one step each.
  const auto matrix = [&](const Eigen::MatrixXd& m, bool both) {
    ordered rows = ordered::array();
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      ordered row = ordered::array();
      for (Eigen::Index k = 0; k < m.cols(); ++k)
        row.push_back(m(i, k) * c.parameters[static_cast<std::size_t>(i)].to_unit *
                      (both ? c.parameters[static_cast<std::size_t>(k)].to_unit : 1.0));
      rows.push_back(std::move(row));
    }
    return rows;
  };
  out["covariance"] = matrix(c.covariance, true);
  out["frame_basis"] = matrix(c.frame_basis, false);
  out["inputs"] = {{"software", software_version()}, {"files", ordered::array()}};
  for (const InputFile& f : c.inputs)
    out["inputs"]["files"].push_back({{"role", f.role}, {"name", f.name}, {"sha256", f.sha256}});
  return write_lines(out);
}

Calibration calibration_from_json(std::string_view text, const std::string& name) {
  refuse_deep_json(text, name);
  const json document = parse_json(text);
  if (document.is_discarded()) throw FileError(name + ": not valid JSON; is the file cut off?");
  const Reader root(document, name);
  if (root.at("format").text() != kFormat)
    throw FileError(name + ".format: must be \"" + std::string(kFormat) +
                    "\"; this is another kind of file or a newer version");
  Calibration c;
  Robot robot = read_robot(table_from_json(write_json(root.at("robot").object()), name + ".robot"));
  c.cell = read_cell(table_from_json(write_json(root.at("cell").object()), name + ".cell"),
                     std::move(robot));
  if (root.has("method")) c.method = root.at("method").text();
  const auto read_level = [](const Reader& r) {
    ModelLevel level;
    level.compliance = r.at("compliance").number();
    level.transmission = r.at("transmission").number();
    level.ripple_rad = r.at("ripple_arcsec").number() * kRadPerArcsec;
    if (r.has("play")) level.play = r.at("play").not_negative();
    if (level.compliance < 0.0 || level.transmission < 0.0 || level.ripple_rad < 0.0)
      r.fail("must not be negative");
    return level;
  };
  if (root.has("model")) {
    const Reader model = root.at("model");
    c.level = read_level(model);
    c.level_reason = model.at("reason").text();
    for (const Reader& item : model.at("considered").items())
      c.levels.push_back(
          {read_level(item), item.at("log_evidence").number(), item.at("probability").number()});
  }
  std::set<ParameterKey> keys;
  for (const Reader& item : root.at("parameters").items()) {
    ParameterResult p;
    p.key = parameter_from_json(c.cell, item.at("name"));
    p.unit = item.at("unit").text();
    if (p.unit == "mm")
      p.to_unit = kMmPerM;
    else if (p.unit == "deg")
      p.to_unit = 57.29577951308232;
    else if (p.unit == "arcsec")
      p.to_unit = 206264.80624709636;
    else if (p.unit != "1/(N m^2)" && p.unit != "rad/(N m)" && p.unit != "kg m rad/(N m)")
      item.at("unit").fail("\"" + shown(p.unit) + "\" is not known");
    const double nominal = item.at("nominal").number() / p.to_unit;
    // What the drawing states is in the cell already; earlier versions wrote 0 here.
    if (stated_value(c.cell, p.key) == 0.0) p.nominal = nominal;
    constexpr double kMostInUnit = 1e6;  // a kilometre, many turns
    if (!(std::abs(item.at("correction").number()) <= kMostInUnit))
      item.at("correction").fail("is out of range, -1e6 to 1e6");
    p.correction = item.at("correction").number() / p.to_unit;
    p.sigma = item.at("sigma").not_negative() / p.to_unit;
    if (!keys.insert(p.key).second)
      item.at("name").fail("\"" + shown(item.at("name").text()) + "\" stands twice");
    const std::string decided = item.at("decided_by").text();
    if (decided != "data" && decided != "prior" && decided != "frame")
      item.at("decided_by").fail("must be \"data\", \"prior\" or \"frame\"");
    p.decided_by = decided == "prior"   ? DecidedBy::kPrior
                   : decided == "frame" ? DecidedBy::kFrame
                                        : DecidedBy::kData;
    c.parameters.push_back(std::move(p));
  }
  for (const Reader& item : root.at("targets").items())
    c.targets.push_back(read_target(item, c.cell));
  if (root.has("lengths"))
    for (const Reader& item : root.at("lengths").items()) c.lengths.push_back(read_length(item));
  const Reader residuals = root.at("residuals");
  c.before = read_summary(residuals.at("before"));
  c.after = read_summary(residuals.at("after"));
  c.check = read_summary(residuals.at("check"));
  if (residuals.has("check_before")) c.check_before = read_summary(residuals.at("check_before"));
  for (const Reader& item : root.at("unidentifiable").items())
    c.unidentifiable.push_back(unidentifiable_from_json(c.cell, item));
  if (root.has("observability")) c.observability = read_observability(root.at("observability"));
  c.predicted_near_targets_m = root.at("predicted").at("m2_mm").number() / kMmPerM;
  c.predicted_workspace_m = root.at("predicted").at("m3_mm").number() / kMmPerM;
  if (root.at("predicted").has("nominal_m3_mm")) {
    c.nominal_near_targets_m = root.at("predicted").at("nominal_m2_mm").not_negative() / kMmPerM;
    c.nominal_workspace_m = root.at("predicted").at("nominal_m3_mm").not_negative() / kMmPerM;
  }
  if (root.has("discrepancy")) {
    const Reader d = root.at("discrepancy");
    c.discrepancy.sigma_m = d.at("sigma_mm").not_negative() / kMmPerM;
    c.discrepancy.reach_rad = d.at("reach_deg").not_negative() / kDegPerRad;
    c.discrepancy.noise_m = d.at("noise_mm").not_negative() / kMmPerM;
    c.discrepancy.estimated = d.at("estimated").flag();
  }
  if (root.has("chi2")) c.chi2 = root.at("chi2").not_negative();
  if (root.has("degrees_of_freedom"))
    c.degrees_of_freedom = root.at("degrees_of_freedom").not_negative();
  if (root.has("chi2_per_dof")) c.chi2_per_dof = root.at("chi2_per_dof").number();
  if (root.has("touch_noise_mm")) c.touch_noise_m = root.at("touch_noise_mm").number() / kMmPerM;
  if (root.has("touch_noise")) {
    const Reader noise = root.at("touch_noise");
    if (noise.has("from_repeats_mm")) {
      c.repeats.scatter_m = noise.at("from_repeats_mm").not_negative() / kMmPerM;
      c.repeats.degrees_of_freedom = noise.at("repeats_degrees_of_freedom").not_negative();
    }
    if (noise.has("used_mm")) {
      c.repeats.touches = static_cast<int>(noise.at("repeated_touches").whole());
      c.repeats.used_m = noise.at("used_mm").not_negative() / kMmPerM;
    }
  }
  const Reader verdict = root.at("verdict");
  c.verdict.publish = verdict.at("publish").flag();
  const std::string scope = verdict.at("scope").text();
  if (scope != "workspace" && scope != "near targets")
    verdict.at("scope").fail("must be \"workspace\" or \"near targets\"");
  c.verdict.workspace = scope == "workspace";
  c.verdict.too_few = verdict.has("too_few_touches") && verdict.at("too_few_touches").flag();
  read_findings(verdict, c.verdict);
  for (const Reader& item : root.at("outliers").items())
    c.outliers.push_back(outlier_from_json(item));
  if (root.has("moved")) {
    for (const Reader& item : root.at("moved").items()) {
      c.moved.emplace_back();
      c.moved.back().target = item.at("target").text();
      c.moved.back().after_touch = item.at("after_touch").whole();
      c.moved.back().shift_m = read_vector_mm(item.at("shift_mm"));
      c.moved.back().sigma_m = item.at("sigma_mm").not_negative() / kMmPerM;
      c.moved.back().squared_sigmas = item.at("squared_sigmas").not_negative();
    }
  }
  if (root.has("jumped")) {
    for (const Reader& item : root.at("jumped").items()) {
      Jump j;
      const std::string what = item.at("what").text();
      if (what != "joint" && what != "tool" && what != "target")
        item.at("what").fail("must be \"joint\", \"tool\" or \"target\"");
      j.what = what == "joint"  ? Jump::What::kJoint
               : what == "tool" ? Jump::What::kTool
                                : Jump::What::kTarget;
      j.name = item.at("name").text();
      j.after_touch = item.at("after_touch").whole();
      if (j.what == Jump::What::kJoint) {
        j.angle_rad = item.at("angle_deg").number() / kDegPerRad;
        j.sigma = item.at("sigma_deg").not_negative() / kDegPerRad;
      } else {
        j.shift_m = read_vector_mm(item.at("shift_mm"));
        j.sigma = item.at("sigma_mm").not_negative() / kMmPerM;
      }
      j.squared_sigmas = item.at("squared_sigmas").not_negative();
      j.log_odds = item.at("log_odds").number();
      c.jumped.push_back(std::move(j));
    }
  }
  const auto n = static_cast<Eigen::Index>(c.parameters.size());
  const auto matrix = [&](const char* key, Eigen::Index columns, bool both) {
    const Reader reader = root.at(key);
    const auto rows = reader.items();
    // An empty covariance would read as perfect knowledge.
    if (static_cast<Eigen::Index>(rows.size()) != n) reader.fail("must have one row per parameter");
    Eigen::MatrixXd m;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto items = rows[i].items();
      if (i == 0) m.setZero(n, columns >= 0 ? columns : static_cast<Eigen::Index>(items.size()));
      if (static_cast<Eigen::Index>(items.size()) != m.cols())
        rows[i].fail("has " + std::to_string(items.size()) + " entries, " +
                     std::to_string(m.cols()) + " are needed");
      for (std::size_t k = 0; k < items.size(); ++k)
        m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
            items[k].number() / c.parameters[i].to_unit / (both ? c.parameters[k].to_unit : 1.0);
    }
    return m;
  };
  c.covariance = matrix("covariance", n, true);
  if (!is_covariance(c.covariance))
    root.at("covariance")
        .fail("is not a covariance (symmetric, no direction with a variance below 0)");
  c.frame_basis = matrix("frame_basis", -1, false);
  for (const Reader& item : root.at("inputs").at("files").items())
    c.inputs.push_back({item.at("role").text(), item.at("name").text(), item.at("sha256").text()});
  return c;
}

Calibration load_calibration(const std::filesystem::path& path) {
  return calibration_from_json(read_file(path), path.string());
}

}  // namespace cellcal::calib
