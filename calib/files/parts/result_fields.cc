#include "calib/files/parts/result_fields.h"

#include <cmath>
#include <string>
#include <vector>

#include "calib/files/parts/finding_json.h"
#include "calib/model/units.h"
#include "calib/words/finding_words.h"

namespace cellcal::calib {

namespace {

using fields::Json, fields::Table, fields::Value, fields::beside, fields::field, fields::flag,
    fields::joined, fields::list, fields::not_negative, fields::number, fields::of_member,
    fields::only_of, fields::optional, fields::text, fields::vector, fields::where, fields::whole,
    fields::word;

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

Value<Eigen::Vector3d> direction() {
  return {vector().to, [](const JsonReader& r) {
            constexpr double kUnit = 1e-6;
            const Eigen::Vector3d v = vector().from(r);
            if (!(std::abs(v.norm() - 1.0) < kUnit)) r.fail("must have length 1");
            return v;
          }};
}

/// Of files without findings: their words alone.
std::vector<Finding> recorded(const JsonReader& reasons, Severity severity) {
  std::vector<Finding> findings;
  for (const JsonReader& reason : reasons.items()) {
    findings.push_back({FindingKind::kRecorded, severity});
    findings.back().text = reason.text();
  }
  return findings;
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
    verdict.findings = recorded(r, verdict.publish ? Severity::kInforms : Severity::kWithholds);
  };
  const Value<Finding> finding{finding_to_json,
                               [&cell](const JsonReader& r) { return finding_from_json(cell, r); }};
  return {
      field("publish", &V::publish, flag()),
      field("scope", &V::workspace, word<bool>({{true, "workspace"}, {false, "near targets"}})),
      {"reasons", [](const V& verdict) -> Json { return words(verdict.findings); }, read_reasons},
      optional(field("findings", &V::findings, list(finding))),
      where<V>([](const V& verdict) { return verdict.too_few; },
               field("too_few_touches", &V::too_few, flag()))};
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
          field("by_others_sigma_mm", &L::sigma_m, not_negative(kMmPerM))};
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
  return {field("what", &J::what,
                word<What>(
                    {{What::kJoint, "joint"}, {What::kTool, "tool"}, {What::kTarget, "target"}})),
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

}  // namespace cellcal::calib
