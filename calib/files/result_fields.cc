#include "calib/files/result_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calib/files/text.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using fields::Field, fields::Json, fields::Table, fields::Value, fields::beside, fields::field,
    fields::flag, fields::for_readers, fields::joined, fields::list, fields::maybe, fields::named,
    fields::not_negative, fields::number, fields::object, fields::of_member, fields::only_of,
    fields::optional, fields::text, fields::vector, fields::where, fields::whole, fields::word;

/// In arcseconds.
Value<double> arcsec() {
  return {[](const double& v) { return v / kRadPerArcsec; },
          [](const JsonReader& r) { return r.not_negative() * kRadPerArcsec; }};
}

std::array<double, 3> read_three(const JsonReader& r) {
  const Eigen::Vector3d v = vector().from(r);
  return {v.x(), v.y(), v.z()};
}

Value<Eigen::Isometry3d> frame() {
  return {[](const Eigen::Isometry3d& pose) -> Json {
            const FrameMmDeg in_file = to_frame(pose);
            return {{"xyz_mm", in_file.xyz_mm}, {"abc_deg", in_file.abc_deg}};
          },
          [](const JsonReader& r) {
            return to_isometry({read_three(r.at("xyz_mm")), read_three(r.at("abc_deg"))});
          }};
}

/// Least and greatest.
Value<std::array<double, 2>> range(double to_unit) {
  return {[to_unit](const std::array<double, 2>& v) -> Json {
            return {v[0] * to_unit, v[1] * to_unit};
          },
          [to_unit](const JsonReader& r) {
            const std::vector<double> ends = list(number(to_unit)).from(r);
            if (ends.size() != 2 || !(ends[0] <= ends[1])) r.fail("must be two ascending numbers");
            return std::array<double, 2>{ends[0], ends[1]};
          }};
}

/// Errors of a carriage, in mm and mrad.
Value<std::array<double, kGuideMotions>> guide_motions() {
  return {[](const std::array<double, kGuideMotions>& v) -> Json {
            Json out = Json::array();
            for (const double one : v) out.push_back(one * kMmPerM);
            return out;
          },
          [](const JsonReader& r) {
            const std::vector<double> read = list(number(kMmPerM)).from(r);
            std::array<double, kGuideMotions> v{};
            if (read.size() != v.size()) r.fail("must be six numbers");
            std::ranges::copy(read, v.begin());
            return v;
          }};
}

Value<Eigen::Vector3d> direction() {
  return {vector().to, [](const JsonReader& r) {
            constexpr double kUnit = 1e-6;
            const Eigen::Vector3d v = vector().from(r);
            if (!(std::abs(v.norm() - 1.0) < kUnit)) r.fail("must have length 1");
            return v;
          }};
}

/// From files without findings: text only.
std::vector<Finding> recorded(const JsonReader& reasons, Severity severity) {
  std::vector<Finding> findings;
  for (const JsonReader& reason : reasons.items()) {
    findings.push_back({FindingKind::kRecorded, severity});
    findings.back().text = reason.text();
  }
  return findings;
}

using fields::from_json, fields::to_json;

constexpr std::array<std::pair<const char*, double>, 11> kUnits{{{"mm", kMmPerM},
                                                                 {"ms", kMsPerS},
                                                                 {"deg", kDegPerRad},
                                                                 {"arcsec", 3600.0 * kDegPerRad},
                                                                 {"mm/m", 1000.0},
                                                                 {"mrad", 1000.0},
                                                                 {"mrad/m", 1000.0},
                                                                 {"mrad/rad", 1000.0},
                                                                 {"1/(N m^2)", 1.0},
                                                                 {"rad/(N m)", 1.0},
                                                                 {"kg m rad/(N m)", 1.0}}};

double per_si(const JsonReader& r) {
  const std::string unit = r.text();
  for (const auto& [name, factor] : kUnits)
    if (unit == name) return factor;
  r.fail("\"" + shown(unit) + "\" is not known");
}

/// The rows after "unit" are in that unit.
Table<ParameterResult> parameter_fields(const Cell& cell) {
  using P = ParameterResult;
  const auto name = [&cell](const P& p) -> Json { return parameter_name(cell, p.key); };
  const auto read_name = [&cell](const JsonReader& r, P& p) {
    p.key = parameter_from_json(cell, r);
  };
  const auto read_unit = [](const JsonReader& r, P& p) {
    p.to_unit = per_si(r);
    p.unit = r.text();
  };
  const auto nominal = [&cell](const P& p) -> Json {
    return (stated_value(cell, p.key) + p.nominal) * p.to_unit;
  };
  const auto read_nominal = [&cell](const JsonReader& r, P& p) {
    const double value = r.number() / p.to_unit;
    if (!is_geometric(p.key.kind) && p.key.kind != ParameterKind::kTcp) {
      p.nominal = value;
      return;
    }
    // Defined by the cell; earlier versions wrote 0.
    const double stated = stated_value(cell, p.key);
    constexpr double kRounding = 1e-9;
    if (value != 0.0 && !(std::abs(value - stated) <= kRounding * std::abs(stated)))
      r.fail(
          fmt::format("is {:g} {}, and {:g} {} in robot or cell: one was altered. Take the file "
                      "from its session again: 'cellcal export ID DIR'",
                      r.number(), p.unit, stated * p.to_unit, p.unit));
  };
  const auto read_correction = [](const JsonReader& r, P& p) {
    constexpr double kMostInUnit = 1e6;  // a kilometre, many turns
    if (!(std::abs(r.number()) <= kMostInUnit)) r.fail("is out of range, -1e6 to 1e6");
    p.correction = r.number() / p.to_unit;
  };
  return {
      {"name", name, read_name},
      {"unit", [](const P& p) -> Json { return p.unit; }, read_unit},
      {"nominal", nominal, read_nominal},
      {"correction", [](const P& p) -> Json { return p.correction * p.to_unit; }, read_correction},
      {"sigma", [](const P& p) -> Json { return p.sigma * p.to_unit; },
       [](const JsonReader& r, P& p) { p.sigma = r.not_negative() / p.to_unit; }},
      field("decided_by", &P::decided_by, named<DecidedBy>())};
}

void read_parameters(const JsonReader& reader, Calibration& c) {
  const auto table = parameter_fields(c.cell);
  std::set<ParameterKey> keys;
  for (const JsonReader& item : reader.items()) {
    from_json(table, item, c.parameters.emplace_back());
    const JsonReader name = item.at("name");
    if (!keys.insert(c.parameters.back().key).second)
      name.fail("\"" + shown(name.text()) + "\" occurs twice");
  }
}

/// Rows are in the parameters' units; columns as well, or single steps.
enum class Columns { kParameters, kSteps };

double column_unit(const Calibration& c, Columns columns, std::size_t k) {
  return columns == Columns::kParameters ? c.parameters[k].to_unit : 1.0;
}

Json matrix_json(const Calibration& c, const Eigen::MatrixXd& m, Columns columns) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index k = 0; k < m.cols(); ++k)
      row.push_back(m(i, k) * c.parameters[static_cast<std::size_t>(i)].to_unit *
                    column_unit(c, columns, static_cast<std::size_t>(k)));
    rows.push_back(std::move(row));
  }
  return rows;
}

Eigen::MatrixXd read_matrix(const JsonReader& reader, const Calibration& c, Columns columns) {
  const auto n = static_cast<Eigen::Index>(c.parameters.size());
  const auto rows = reader.items();
  // An empty covariance would be read as perfect knowledge.
  if (static_cast<Eigen::Index>(rows.size()) != n) reader.fail("must have one row per parameter");
  const Eigen::Index wanted = columns == Columns::kParameters ? n
                              : rows.empty()                  ? 0
                                             : static_cast<Eigen::Index>(rows[0].items().size());
  // All rows are validated before the matrix is allocated: a short file must not cause a large allocation.
  for (const JsonReader& row : rows)
    if (static_cast<Eigen::Index>(row.items().size()) != wanted)
      row.fail("has " + std::to_string(row.items().size()) + " entries, " + std::to_string(wanted) +
               " are needed");
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, wanted);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto items = rows[i].items();
    for (std::size_t k = 0; k < items.size(); ++k)
      m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          items[k].number() / c.parameters[i].to_unit / column_unit(c, columns, k);
  }
  return m;
}

/// True if the bounds derived from it are real numbers.
bool is_covariance(const Eigen::MatrixXd& m) {
  if (m.size() == 0) return true;     // no parameters
  constexpr double kRounding = 1e-9;  // tolerance of correlations
  const Eigen::VectorXd sigma = m.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd scale = (sigma.array() > 0.0).select(sigma, 1.0).cwiseInverse();
  Eigen::MatrixXd correlation = scale.asDiagonal() * m * scale.asDiagonal();
  if (!correlation.allFinite() || m.diagonal().minCoeff() < 0.0) return false;
  if ((correlation - correlation.transpose()).cwiseAbs().maxCoeff() > kRounding) return false;
  correlation.diagonal().array() += kRounding;
  return Cholesky(correlation).positive();
}

void read_covariance(const JsonReader& reader, Calibration& c) {
  c.covariance = read_matrix(reader, c, Columns::kParameters);
  if (!is_covariance(c.covariance))
    reader.fail("is not a covariance (symmetric, no direction with a variance below 0)");
}

}  // namespace

Table<ResidualSummary> summary_fields() {
  using R = ResidualSummary;
  return {field("mean_mm", &R::mean_m, number(kMmPerM)),
          field("max_mm", &R::max_m, number(kMmPerM)), field("rms_mm", &R::rms_m, number(kMmPerM)),
          optional(field("count", &R::count, whole<int>()))};
}

Table<ModelLevel> level_fields() {
  using L = ModelLevel;
  return {field("compliance", &L::compliance, not_negative()),
          field("transmission", &L::transmission, not_negative()),
          field("ripple_arcsec", &L::ripple_rad, arcsec()),
          where<L>([](const L& level) { return level.play > 0.0; },
                   field("play", &L::play, not_negative()))};
}

Table<LevelEvidence> evidence_fields() {
  using E = LevelEvidence;
  return joined(of_member(&E::level, level_fields()),
                {field("log_evidence", &E::log_evidence, number()),
                 field("probability", &E::probability, number())});
}

Table<TargetResult> target_fields(const Cell& cell) {
  using T = TargetResult;
  const auto read_id = [&cell](const JsonReader& r, T& target) {
    target.id = r.text();
    for (const Target& one : cell.targets)
      if (one.id == target.id) target.kind = one.kind;
  };
  const auto plane = [](const T& target) { return target.kind == TargetKind::kPlane; };
  const auto tracker = [](const T& target) { return target.kind == TargetKind::kTracker; };
  return {{"id", [](const T& target) -> Json { return target.id; }, read_id},
          field("centre_mm", &T::centre_m, vector(kMmPerM)),
          field("effective_radius_mm", &T::effective_radius_m, number(kMmPerM)),
          only_of<T>(plane, field("normal", &T::normal, direction())),
          only_of<T>(plane, field("distance_mm", &T::distance_m, number(kMmPerM))),
          only_of<T>(tracker, field("frame", &T::frame, frame()))};
}

Table<PositionerLine> positioner_fields() {
  using P = PositionerLine;
  constexpr double kMradPerRad = 1000.0;
  return {field("axis", &P::axis, text()),
          field("xyz_mm", &P::point_m, vector(kMmPerM)),
          field("direction", &P::direction, direction()),
          field("frame", &P::frame, frame()),
          field("place_u95_mm", &P::place_u95_m, not_negative(kMmPerM)),
          field("direction_u95_mrad", &P::direction_u95_rad, not_negative(kMradPerRad)),
          maybe("touched_deg", &P::touched_rad, range(kDegPerRad))};
}

Table<LinearUnitLine> linear_unit_fields() {
  using L = LinearUnitLine;
  using At = LinearUnitLine::At;
  constexpr double kPerMille = 1000.0;
  const Table<At> at{field("position_mm", &At::position_m, number(kMmPerM)),
                     field("motion", &At::motion, guide_motions()),
                     field("u95", &At::u95, guide_motions())};
  return {field("axis", &L::axis, text()),
          field("direction", &L::direction, direction()),
          field("direction_u95_mrad", &L::direction_u95_rad, not_negative(kPerMille)),
          field("scale_mm_per_m", &L::scale, number(kPerMille)),
          field("scale_u95_mm_per_m", &L::scale_u95, not_negative(kPerMille)),
          field("at", &L::at, list(object(at))),
          maybe("touched_mm", &L::touched_m, range(kMmPerM))};
}

Table<Observability> observability_fields() {
  using O = Observability;
  return {field("rows", &O::rows, whole<int>()),
          field("unknowns", &O::unknowns, whole<int>()),
          field("directions", &O::directions, whole<int>()),
          field("rank", &O::rank, whole<int>()),
          field("told", &O::determined, whole<int>()),
          field("o1", &O::o1, not_negative()),
          field("o2", &O::o2, not_negative()),
          field("o3", &O::o3, not_negative()),
          field("o4", &O::o4, not_negative()),
          field("o5", &O::o5, not_negative()),
          field("condition", &O::condition, not_negative()),
          field("singular_values", &O::singular_values, list(not_negative()))};
}

Table<Discrepancy> discrepancy_fields() {
  using D = Discrepancy;
  return {field("sigma_mm", &D::sigma_m, not_negative(kMmPerM)),
          field("reach_deg", &D::reach_rad, not_negative(kDegPerRad)),
          field("noise_mm", &D::noise_m, not_negative(kMmPerM)),
          field("estimated", &D::estimated, flag())};
}

Table<RepeatedTouches> repeats_fields() {
  using R = RepeatedTouches;
  const auto measured = [](const R& repeats) { return repeats.degrees_of_freedom > 0.0; };
  const auto used = [](const R& repeats) { return repeats.used_m > 0.0; };
  return {
      where<R>(measured, field("from_repeats_mm", &R::scatter_m, not_negative(kMmPerM))),
      where<R>(measured, beside("from_repeats_mm", field("repeats_degrees_of_freedom",
                                                         &R::degrees_of_freedom, not_negative()))),
      where<R>(used, beside("used_mm", field("repeated_touches", &R::touches, whole<int>()))),
      where<R>(used, field("used_mm", &R::used_m, not_negative(kMmPerM)))};
}

Table<Verdict> verdict_fields(const Cell& cell) {
  using V = Verdict;
  const auto read_reasons = [](const JsonReader& r, V& verdict) {
    verdict.findings = recorded(r, verdict.judged ? Severity::kInforms : Severity::kWithholds);
  };
  const auto read_publish = [](const JsonReader& r, V& verdict) { verdict.judged = r.flag(); };
  const Value<Finding> finding{finding_to_json,
                               [&cell](const JsonReader& r) { return finding_from_json(cell, r); }};
  const auto all = list(finding);
  const auto write_findings = [all](const V& verdict) { return all.to(verdict.findings); };
  const auto read_findings = [all](const JsonReader& r, V& verdict) {
    verdict.findings = all.from(r);
    if (verdict.judged && !verdict.publish())
      r.fail("contradict \"publish\": one of them withholds");
  };
  return {
      {"publish", [](const V& verdict) -> Json { return verdict.publish(); }, read_publish},
      field("scope", &V::workspace, word<bool>({{true, "workspace"}, {false, "near targets"}})),
      {"reasons", [](const V& verdict) -> Json { return words(verdict.findings); }, read_reasons},
      optional(Field<V>{"findings", write_findings, read_findings}),
      where<V>([](const V& verdict) { return verdict.too_few(); },
               for_readers<V>("too_few_touches", [](const V&) -> Json { return true; }))};
}

Table<UncertaintyLine> uncertainty_fields() {
  using L = UncertaintyLine;
  const auto source = named<UncertaintySource>("no source of uncertainty");
  const auto write_sigma = [](const L& line) -> Json {
    return line.sigma * unit_of(line.source).per_si;
  };
  const auto read_sigma = [](const JsonReader& r, L& line) {
    line.sigma = not_negative().from(r) / unit_of(line.source).per_si;
  };
  return {field("source", &L::source, source),
          {"sigma", write_sigma, read_sigma},
          for_readers<L>("unit", [](const L& line) -> Json { return unit_of(line.source).name; }),
          field("m2_mm", &L::near_targets_m, not_negative(kMmPerM)),
          field("m3_mm", &L::workspace_m, not_negative(kMmPerM))};
}

Table<LengthResult> length_fields() {
  using L = LengthResult;
  const auto read_ends = [](const JsonReader& r, L& length) {
    const auto ends = r.items();
    if (ends.size() != 2) r.fail("must name two targets");
    length.from = ends[0].text();
    length.to = ends[1].text();
  };
  return {{"between",
           [](const L& length) {
             return Json::array({length.from, length.to});
           },
           read_ends},
          field("certified_mm", &L::certified_m, not_negative(kMmPerM)),
          field("certified_sigma_mm", &L::certified_sigma_m, not_negative(kMmPerM)),
          field("by_others_mm", &L::by_others_m, number(kMmPerM)),
          field("by_others_sigma_mm", &L::sigma_m, not_negative(kMmPerM)),
          where<L>([](const L& length) { return length.is_check; },
                   field("role", &L::is_check, word<bool>({{true, "check"}, {false, "fit"}})))};
}

Table<MovedTarget> moved_fields() {
  using M = MovedTarget;
  return {field("target", &M::target, text()),
          field("after_touch", &M::after_touch, whole<std::size_t>()),
          field("shift_mm", &M::shift_m, vector(kMmPerM)),
          field("sigma_mm", &M::sigma_m, not_negative(kMmPerM)),
          field("squared_sigmas", &M::squared_sigmas, not_negative())};
}

Table<Jump> jump_fields() {
  using J = Jump;
  using What = Jump::What;
  const auto joint = [](const J& jump) { return jump.what == What::kJoint; };
  const auto place = [](const J& jump) { return jump.what != What::kJoint; };
  return {field("what", &J::what, named<Jump::What>()),
          field("name", &J::name, text()),
          field("after_touch", &J::after_touch, whole<std::size_t>()),
          only_of<J>(joint, field("angle_deg", &J::angle_rad, number(kDegPerRad))),
          only_of<J>(joint, field("sigma_deg", &J::sigma, not_negative(kDegPerRad))),
          only_of<J>(place, field("shift_mm", &J::shift_m, vector(kMmPerM))),
          only_of<J>(place, field("sigma_mm", &J::sigma, not_negative(kMmPerM))),
          field("squared_sigmas", &J::squared_sigmas, not_negative()),
          field("log_odds", &J::log_odds, number())};
}

Table<InputFile> input_fields() {
  using I = InputFile;
  return {field("role", &I::role, text()), field("name", &I::name, text()),
          field("sha256", &I::sha256, text())};
}

Field<Calibration> parameters_field() {
  return {"parameters",
          [](const Calibration& c) {
            const auto table = parameter_fields(c.cell);
            Json out = Json::array();
            for (const ParameterResult& p : c.parameters) out.push_back(to_json(table, p));
            return out;
          },
          read_parameters};
}

Field<Calibration> covariance_field() {
  return {"covariance",
          [](const Calibration& c) { return matrix_json(c, c.covariance, Columns::kParameters); },
          read_covariance};
}

Field<Calibration> frame_basis_field() {
  return {"frame_basis",
          [](const Calibration& c) { return matrix_json(c, c.frame_basis, Columns::kSteps); },
          [](const JsonReader& r, Calibration& c) {
            c.frame_basis = read_matrix(r, c, Columns::kSteps);
          }};
}

}  // namespace cellcal::calib
