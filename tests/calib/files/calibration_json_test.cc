// "cellcal.calibration/1": complete for prediction, and read back unchanged.

#include "calib/files/calibration_json.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/files/input_file.h"
#include "calib/identify/identify.h"
#include "calib/result/finding.h"
#include "calib/result/level.h"
#include "calib/result/likely_cause.h"
#include "calib/result/unidentifiable.h"
#include "tests/calib/files/documents.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using nlohmann::json;
using testing::expect_words;
using testing::refusal;
using testing::without_sum;

/// A calibration with all features: compliance, gears, an unknown TCP, an outlier.
const Calibration& result() {
  static const Calibration calibration = [] {
    Cell cell = testing::demo_cell();
    cell.tool.tcp_sigma_m.setConstant(5e-4);
    for (Joint& joint : cell.robot.joints) {
      joint.mass_kg = 10.0;
      joint.compliance_sigma_rad_per_nm = 1e-6;
      joint.harmonics = {1};
      joint.harmonic_sigma_rad = 5e-5;
    }
    auto made = testing::make_touches(cell, testing::plain_truth(cell, 3),
                                      {.fit = 60, .check = 10, .outlier_share = 0.05, .seed = 4});
    Calibration c = identify(cell, made.touches);
    c.inputs = {{"cell", "cell.toml", sha256("cell")}, {"touches", "touches.csv", sha256("t")}};
    return c;
  }();
  return calibration;
}

const std::string& written() {
  static const std::string text = calibration_to_json(result());
  return text;
}

Calibration read_back() { return calibration_from_json(written(), "cal.json"); }

/// Files hold a finding's numbers by name, unordered.
Finding sorted(Finding finding) {
  const auto by_name = [](const Quantity& a, const Quantity& b) { return a.name < b.name; };
  std::sort(finding.evidence.begin(), finding.evidence.end(), by_name);
  for (FindingPart& part : finding.parts)
    std::sort(part.evidence.begin(), part.evidence.end(), by_name);
  return finding;
}

TEST(CalibrationJson, KeepsTheLoadsOfItsTouches) {
  EXPECT_FALSE(json::parse(without_sum(written())).contains("touched_loads"));
  Calibration c = result();
  c.touched_loads = {"", "full"};
  const std::string text = without_sum(calibration_to_json(c));
  EXPECT_EQ(calibration_from_json(text, "cal.json").touched_loads, c.touched_loads);
}

TEST(CalibrationJson, KeepsThePosturesThatATrackerMeasured) {
  EXPECT_FALSE(json::parse(without_sum(written())).contains("region")) << "spheres were touched";
  Calibration c = result();
  c.region = {{0.1, -1.2, 1.3, 0.4, 0.5, 0.6}, {0.2, -1.1, 1.2, 0.3, 0.4, 0.5}};
  json document = json::parse(without_sum(calibration_to_json(c)));
  const Calibration back = calibration_from_json(document.dump(), "cal.json");
  ASSERT_EQ(back.region.size(), 2u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(back.region[1][i], c.region[1][i], 1e-14);
  for (const std::size_t joints : {5u, 7u, 5000u}) {
    document["region"]["postures"][1] = std::vector<double>(joints, 0.1);
    expect_words(refusal([&] { (void)calibration_from_json(document.dump(), "cal.json"); }),
                 {"region.postures[1]", "value per joint"});
  }
  document["region"]["postures"] = "all";
  expect_words(refusal([&] { (void)calibration_from_json(document.dump(), "cal.json"); }),
               {"region.postures", "array"});
}

TEST(CalibrationJson, KeepsLikelyCausesAsValuesBesideTheirWords) {
  Calibration c = result();
  const Finding cause = likely(LikelyCause::kMastering, about_joint("A3"), {{"add", -2.0, "deg"}});
  Finding still{FindingKind::kStillWithModelError, Severity::kWarns};
  still.still = {cause};
  const Finding off{FindingKind::kEffectiveRadius,
                    Severity::kWarns,
                    about_parameter(c.cell, tool_parameter(ParameterKind::kEffectiveRadius, 0)),
                    {{"off", 1.0, "mm"}}};
  c.verdict.findings = {cause, still, off};
  json file = json::parse(without_sum(calibration_to_json(c)));
  const json& findings = file["verdict"]["findings"];
  EXPECT_EQ(findings[0]["cause"], "mastering");
  EXPECT_EQ(findings[0]["text"], cause_words(cause));
  EXPECT_EQ(findings[1]["text"], words(cause));
  EXPECT_EQ(findings[2]["about"]["name"], "touch.rho");
  EXPECT_EQ(file["verdict"]["reasons"][0], words(cause));
  EXPECT_EQ(calibration_from_json(file.dump(), "c.json").verdict.findings, c.verdict.findings);

  // From a later version, or from one with text only.
  for (const bool later : {true, false}) {
    json other = file;
    if (later)
      other["verdict"]["findings"][0]["cause"] = "gremlins";
    else
      other["verdict"]["findings"][0].erase("cause");
    const Calibration read = calibration_from_json(other.dump(), "c.json");
    EXPECT_EQ(read.verdict.findings[0].cause, std::nullopt);
    EXPECT_EQ(words(read.verdict.findings[0]), words(cause));
  }
  file["verdict"]["findings"][0]["cause"] = 7;
  EXPECT_THROW((void)calibration_from_json(file.dump(), "c.json"), FileError);
}

TEST(CalibrationJson, KeepsWhyATargetIsNotJudgedAsValuesBesideItsWords) {
  Calibration c = result();
  const Finding not_judged{FindingKind::kUnseenNotJudged,
                           Severity::kWarns,
                           about_target(c.cell.targets.front()),
                           {{"no_place", 1.0, ""}, {"touches", 3.0, ""}}};
  c.verdict.findings = {not_judged};
  json file = json::parse(without_sum(calibration_to_json(c)));
  json& finding = file["verdict"]["findings"][0];
  const auto why = finding["text"].get<std::string>();
  EXPECT_FALSE(why.empty());
  EXPECT_TRUE(words(not_judged).ends_with(why));
  EXPECT_EQ(calibration_from_json(file.dump(), "c.json").verdict.findings, c.verdict.findings);
  // From an earlier version with text only.
  finding["evidence"] = json::object();
  const Finding earlier = calibration_from_json(file.dump(), "c.json").verdict.findings.front();
  EXPECT_EQ(earlier.text, why);
  EXPECT_EQ(words(earlier), words(not_judged));
}

TEST(CalibrationJson, KeepsHowTheLevelWasTakenBesideItsWords) {
  json file = json::parse(without_sum(calibration_to_json(result())));
  EXPECT_EQ(file["model"]["chosen"], "mean_by_evidence");
  EXPECT_EQ(file["model"]["reason"], level_and_reason_words(result()));
  EXPECT_EQ(read_back().level_reason, result().level_reason);
  EXPECT_EQ(level_and_reason_words(read_back()), level_and_reason_words(result()));
  file["model"].erase("chosen");
  const Calibration earlier = calibration_from_json(file.dump(), "c.json");
  EXPECT_EQ(earlier.level_reason.choice, LevelChoice::kRecorded);
  EXPECT_EQ(level_and_reason_words(earlier), level_and_reason_words(result()));
}

TEST(CalibrationJson, ShowsEachDigitThatIsAnotherByItsSum) {
  ASSERT_TRUE(states_sum(written()));
  ASSERT_NO_THROW((void)read_back());
  int changed = 0;
  for (std::size_t at = written().find_first_of("0123456789"); at != std::string::npos;
       at = written().find_first_of("0123456789", at + 1 + written().size() / 400)) {
    std::string altered = written();
    altered[at] = altered[at] == '7' ? '8' : '7';
    if (json::parse(altered, nullptr, false) == json::parse(written()))
      continue;  // the same number
    ++changed;
    EXPECT_THROW((void)calibration_from_json(altered, "cal.json"), FileError)
        << altered.substr(at - 30, 60);
  }
  EXPECT_GT(changed, 250);
  expect_words(refusal([&] {
                 json document = json::parse(written());
                 document["verdict"]["publish"] = !result().verdict.publish();
                 (void)calibration_from_json(document.dump(), "cal.json");
               }),
               {"cal.json: sum: not that of its content", "cellcal export ID DIR"});
}

TEST(CalibrationJson, IsRefusedWhereItIsPublishedAgainstAWithholdingFinding) {
  Calibration withheld = result();
  withheld.verdict.add(Finding{FindingKind::kRank});
  json document = json::parse(calibration_to_json(withheld));
  EXPECT_EQ(document["verdict"]["publish"], false);
  document["verdict"]["publish"] = true;
  document.erase("sum");
  expect_words(refusal([&] { (void)calibration_from_json(document.dump(), "cal.json"); }),
               {"cal.json.verdict.findings: contradict \"publish\""});
}

TEST(CalibrationJson, KeepsItsSumInAnyOrderAndSpacingAndIsReadWithoutOneAsEarlier) {
  for (const std::string& other :
       {json::parse(written()).dump(), nlohmann::ordered_json::parse(written()).dump(7)})
    EXPECT_NO_THROW((void)calibration_from_json(other, "cal.json"));
  const std::string earlier = without_sum(written());
  EXPECT_FALSE(states_sum(earlier));
  EXPECT_EQ(calibration_to_json(calibration_from_json(earlier, "cal.json")),
            calibration_to_json(read_back()));
}

TEST(CalibrationJson, RefusesANominalValueThatIsNotTheRobotsOrTheCellsOwn) {
  for (const auto& [member, joint] : {std::pair("d_mm", 0), std::pair("a_mm", 1)}) {
    json document = json::parse(without_sum(written()));
    json& length = document["robot"]["joint"][joint][member];
    length = length.get<double>() + 30.0;
    expect_words(refusal([&] { (void)calibration_from_json(document.dump(), "cal.json"); }),
                 {".nominal: is ", " in robot or cell: one was altered"});
  }
  json document = json::parse(without_sum(written()));
  for (json& one : document["parameters"]) one["nominal"] = 0.0;
  EXPECT_NO_THROW((void)calibration_from_json(document.dump(), "cal.json"))
      << "of earlier versions";
}

TEST(CalibrationJson, PredictsTheSameAfterwards) {
  const Calibration back = read_back();
  const Predictor before(result()), after(back);
  const ArmModel arm(result().cell.robot, result().cell.tool);
  for (const JointVector& q : workspace_poses(arm, 200, 5)) {
    const Prediction a = before.calibrated(q), b = after.calibrated(q);
    EXPECT_LT((a.tcp.translation() - b.tcp.translation()).norm(), 1e-12);
    EXPECT_LT((a.tcp.linear() - b.tcp.linear()).norm(), 1e-11);
    EXPECT_LT((before.nominal(q).translation() - after.nominal(q).translation()).norm(), 1e-12);
    EXPECT_NEAR(a.u95_m, b.u95_m, 1e-6 * a.u95_m);
  }
}

TEST(CalibrationJson, KeepsParametersCovarianceAndFrame) {
  const Calibration back = read_back();
  ASSERT_EQ(back.parameters.size(), result().parameters.size());
  for (std::size_t i = 0; i < back.parameters.size(); ++i) {
    const ParameterResult &a = result().parameters[i], &b = back.parameters[i];
    EXPECT_EQ(a.key, b.key);
    EXPECT_EQ(a.unit, b.unit);
    EXPECT_EQ(a.decided_by, b.decided_by);
    EXPECT_NEAR(a.to_unit, b.to_unit, 1e-12 * a.to_unit);
    EXPECT_NEAR(a.nominal, b.nominal, 1e-12 * std::abs(a.nominal));
    EXPECT_NEAR(a.correction, b.correction, 1e-12 * std::abs(a.correction));
    EXPECT_NEAR(a.sigma, b.sigma, 1e-12 * a.sigma);
  }
  ASSERT_EQ(back.covariance.rows(), result().covariance.rows());
  EXPECT_TRUE(back.covariance.isApprox(result().covariance, 1e-12));
  ASSERT_EQ(back.frame_basis.cols(), result().frame_basis.cols());
  EXPECT_TRUE(back.frame_basis.isApprox(result().frame_basis, 1e-12));
}

void expect_same(const ResidualSummary& a, const ResidualSummary& b) {
  EXPECT_EQ(a.count, b.count);
  EXPECT_NEAR(a.mean_m, b.mean_m, 1e-15);
  EXPECT_NEAR(a.max_m, b.max_m, 1e-15);
  EXPECT_NEAR(a.rms_m, b.rms_m, 1e-15);
}

TEST(CalibrationJson, KeepsTargetsResidualsOutliersVerdictAndInputs) {
  const Calibration back = read_back();
  ASSERT_EQ(back.targets.size(), result().targets.size());
  for (std::size_t i = 0; i < back.targets.size(); ++i) {
    EXPECT_EQ(back.targets[i].id, result().targets[i].id);
    EXPECT_LT((back.targets[i].centre_m - result().targets[i].centre_m).norm(), 1e-15);
    EXPECT_NEAR(back.targets[i].effective_radius_m, result().targets[i].effective_radius_m, 1e-15);
  }
  expect_same(back.before, result().before);
  expect_same(back.after, result().after);
  expect_same(back.check, result().check);
  expect_same(back.check_before, result().check_before);
  ASSERT_FALSE(result().outliers.empty());
  ASSERT_EQ(back.outliers.size(), result().outliers.size());
  for (std::size_t i = 0; i < back.outliers.size(); ++i) {
    EXPECT_EQ(back.outliers[i].touch, result().outliers[i].touch);
    EXPECT_EQ(words(back.outliers[i]), words(result().outliers[i]));
    EXPECT_EQ(back.outliers[i].kind, result().outliers[i].kind);
    EXPECT_NE(back.outliers[i].kind, OutlierKind::kRecorded);
    EXPECT_EQ(back.outliers[i].target, result().outliers[i].target);
    EXPECT_EQ(back.outliers[i].sigmas, result().outliers[i].sigmas);
    EXPECT_GT(back.outliers[i].leverage, 0.0);
    EXPECT_EQ(back.outliers[i].leverage, result().outliers[i].leverage);
  }
  EXPECT_EQ(back.verdict.publish(), result().verdict.publish());
  EXPECT_FALSE(back.verdict.too_few());
  Calibration begun = result();
  begun.verdict.findings = {Finding{FindingKind::kTooFewTouches}};
  EXPECT_TRUE(calibration_from_json(calibration_to_json(begun), "c.json").verdict.too_few());
  EXPECT_EQ(back.verdict.workspace, result().verdict.workspace);
  ASSERT_EQ(back.verdict.findings.size(), result().verdict.findings.size());
  for (std::size_t i = 0; i < back.verdict.findings.size(); ++i)
    EXPECT_EQ(sorted(back.verdict.findings[i]), sorted(result().verdict.findings[i])) << i;
  ASSERT_EQ(back.unidentifiable.size(), result().unidentifiable.size());
  const auto in_order = [](UnidentifiableDirection d) {  // shares are an object of the file
    std::sort(d.direction.begin(), d.direction.end());
    return d;
  };
  for (std::size_t i = 0; i < back.unidentifiable.size(); ++i)
    EXPECT_EQ(in_order(back.unidentifiable[i]), in_order(result().unidentifiable[i])) << i;
  EXPECT_EQ(back.method, result().method);
  ASSERT_GT(result().degrees_of_freedom, 1.0);
  EXPECT_EQ(back.chi2, result().chi2);
  EXPECT_EQ(back.degrees_of_freedom, result().degrees_of_freedom);
  EXPECT_NEAR(back.chi2_per_dof, result().chi2_per_dof, 1e-12);
  EXPECT_NEAR(back.predicted_near_targets_m, result().predicted_near_targets_m, 1e-15);
  EXPECT_NEAR(back.predicted_workspace_m, result().predicted_workspace_m, 1e-15);
  ASSERT_EQ(back.inputs.size(), 2u);
  EXPECT_EQ(back.inputs[1].sha256, sha256("t"));
}

TEST(CalibrationJson, HoldsTheKeysThatOthersRelyOn) {
  const json document = json::parse(without_sum(written()));
  EXPECT_EQ(document["format"], "cellcal.calibration/1");
  for (const char* key : {"robot", "cell", "parameters", "targets", "residuals", "unidentifiable",
                          "predicted", "verdict", "outliers", "covariance", "inputs"})
    EXPECT_TRUE(document.contains(key)) << key;
  for (const char* key : {"name", "unit", "nominal", "correction", "sigma", "decided_by"})
    EXPECT_TRUE(document["parameters"][0].contains(key)) << key;
  EXPECT_EQ(document["verdict"]["scope"], "workspace");
  EXPECT_NEAR(document["targets"][0]["effective_radius_mm"].get<double>(), 30.7, 1.0);
  EXPECT_NEAR(document["targets"][0]["centre_mm"][2].get<double>(), 330.0, 50.0);
}

TEST(CalibrationJson, SaysWhatTheFilesStateOfEachParameter) {
  json document = json::parse(without_sum(written()));
  const auto nominal = [&](const std::string& name) -> double {
    for (const auto& p : document.at("parameters"))
      if (p.at("name") == name) return p.at("nominal");
    return std::nan("");
  };
  const auto& joints = result().cell.robot.joints;
  EXPECT_NEAR(nominal("A4.d"), joints[3].d_m * 1e3, 1e-9);
  EXPECT_GT(nominal("A4.d"), 100.0);
  EXPECT_NEAR(nominal("A3.alpha"), joints[2].alpha_rad * 180.0 / M_PI, 1e-9);
  EXPECT_NEAR(nominal("A3.theta"), joints[2].offset_rad * 180.0 / M_PI, 1e-9);
  EXPECT_NEAR(nominal("tool.z"), result().cell.tool.tcp.translation().z() * 1e3, 1e-9);
  // Calibrations of earlier versions contain 0 there, with the same meaning.
  for (auto& p : document["parameters"])
    if (!p["name"].get<std::string>().starts_with("S")) p["nominal"] = 0.0;
  const JointVector q = {0.1, -1.2, 1.3, 0.4, 0.5, 0.6};
  EXPECT_EQ(Predictor(calibration_from_json(document.dump(), "old")).calibrated(q).tcp.matrix(),
            Predictor(read_back()).calibrated(q).tcp.matrix());
}

TEST(CalibrationJson, NamesThePairsThatGoTogetherAndTheyComeBackFromTheCovariance) {
  const auto written_pairs = json::parse(without_sum(written()))["correlations"];
  const auto pairs = strong_correlations(result()).pairs;
  ASSERT_FALSE(pairs.empty());
  ASSERT_EQ(written_pairs.size(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(written_pairs[i]["a"],
              parameter_name(result().cell, result().parameters[pairs[i].first].key));
    EXPECT_EQ(written_pairs[i]["b"],
              parameter_name(result().cell, result().parameters[pairs[i].second].key));
    EXPECT_NEAR(written_pairs[i]["value"].get<double>(), pairs[i].correlation, 5.1e-5);
  }
  EXPECT_EQ(json::parse(without_sum(calibration_to_json(read_back())))["correlations"],
            written_pairs);
}

TEST(CalibrationJson, KeepsWhichTargetMovedAndByHowMuch) {
  EXPECT_TRUE(json::parse(without_sum(written()))["moved"].empty());
  Calibration c = result();
  c.moved.emplace_back();
  c.moved[0].target = "S2";
  c.moved[0].after_touch = 36;
  c.moved[0].shift_m = Eigen::Vector3d(1e-4, -2e-4, 0.0);
  c.moved[0].sigma_m = 2e-5;
  c.moved[0].squared_sigmas = 120.0;
  const Calibration back = calibration_from_json(calibration_to_json(c), "cal.json");
  ASSERT_EQ(back.moved.size(), 1U);
  EXPECT_EQ(back.moved[0].target, "S2");
  EXPECT_EQ(back.moved[0].after_touch, 36U);
  EXPECT_LT((back.moved[0].shift_m - c.moved[0].shift_m).norm(), 1e-15);
  EXPECT_NEAR(back.moved[0].sigma_m, 2e-5, 1e-15);
  EXPECT_EQ(back.moved[0].squared_sigmas, 120.0);
  json document = json::parse(without_sum(calibration_to_json(c)));
  document["moved"][0]["sigma_mm"] = -1;
  expect_words(refusal([&] { (void)calibration_from_json(document.dump(), "cal.json"); }),
               {"moved[0].sigma_mm"});
}

TEST(CalibrationJson, KeepsWhatAllElseSaysOfCertifiedLengths) {
  ASSERT_EQ(result().lengths.size(), result().cell.lengths.size());
  const Calibration back = read_back();
  ASSERT_EQ(back.lengths.size(), result().lengths.size());
  for (std::size_t k = 0; k < back.lengths.size(); ++k) {
    const LengthResult &a = result().lengths[k], &b = back.lengths[k];
    EXPECT_EQ(a.from, b.from);
    EXPECT_EQ(a.to, b.to);
    EXPECT_NEAR(a.certified_m, b.certified_m, 1e-12);
    EXPECT_NEAR(a.certified_sigma_m, b.certified_sigma_m, 1e-15);
    EXPECT_NEAR(a.by_others_m, b.by_others_m, 1e-12);
    EXPECT_NEAR(a.sigma_m, b.sigma_m, 1e-15);
  }
  json document = json::parse(without_sum(written()));
  document["lengths"][0]["between"] = {"S1"};
  expect_words(refusal([&] { (void)calibration_from_json(document.dump(), "cal.json"); }),
               {"lengths[0].between", "two targets"});
  document = json::parse(without_sum(written()));
  document.erase("lengths");  // written by earlier versions without it
  EXPECT_TRUE(calibration_from_json(document.dump(), "cal.json").lengths.empty());
}

TEST(CalibrationJson, KeepsWhatRepeatedTouchesMeasured) {
  const auto noise = json::parse(without_sum(written()))["touch_noise"];
  EXPECT_NEAR(noise["stated_mm"].get<double>(), 0.03, 1e-12);
  EXPECT_EQ(noise["from_residuals_mm"], json::parse(without_sum(written()))["touch_noise_mm"]);
  EXPECT_FALSE(noise.contains("from_repeats_mm")) << "there are none";
  Calibration c = result();
  c.repeats = {30, 1.2e-5, 20.0, 1.7e-5};
  const Calibration back = calibration_from_json(calibration_to_json(c), "cal.json");
  EXPECT_EQ(back.repeats.touches, 30);
  EXPECT_NEAR(back.repeats.scatter_m, 1.2e-5, 1e-18);
  EXPECT_EQ(back.repeats.degrees_of_freedom, 20.0);
  EXPECT_NEAR(back.repeats.used_m, 1.7e-5, 1e-18);
}

TEST(CalibrationJson, KeepsWhatTheModelLacksAndTheNominalArmsOwnError) {
  EXPECT_FALSE(json::parse(without_sum(written())).contains("discrepancy")) << "there is none";
  Calibration c = result();
  c.discrepancy.sigma_m = 2.1e-4;
  c.discrepancy.reach_rad = 0.3;
  c.discrepancy.noise_m = 3e-5;
  c.discrepancy.estimated = true;
  c.nominal_near_targets_m = 1.5e-3;
  c.nominal_workspace_m = 2.5e-3;
  c.nominal_near_targets_u_m = 1.1e-4;
  c.nominal_workspace_u_m = 1.2e-4;
  const std::string text = without_sum(calibration_to_json(c));
  const Calibration back = calibration_from_json(text, "cal.json");
  EXPECT_NEAR(back.discrepancy.sigma_m, 2.1e-4, 1e-15);
  EXPECT_NEAR(back.discrepancy.reach_rad, 0.3, 1e-12);
  EXPECT_NEAR(back.discrepancy.noise_m, 3e-5, 1e-15);
  EXPECT_TRUE(back.discrepancy.estimated);
  EXPECT_NEAR(back.nominal_near_targets_m, 1.5e-3, 1e-15);
  EXPECT_NEAR(back.nominal_workspace_m, 2.5e-3, 1e-15);
  EXPECT_NEAR(back.nominal_near_targets_u_m, 1.1e-4, 1e-15);
  EXPECT_NEAR(back.nominal_workspace_u_m, 1.2e-4, 1e-15);
  json document = json::parse(text);
  document["discrepancy"]["sigma_mm"] = -0.1;
  expect_words(refusal([&] { (void)calibration_from_json(document.dump(), "cal.json"); }),
               {"discrepancy.sigma_mm"});
}

TEST(CalibrationJson, KeepsTheObservability) {
  const Observability &o = result().observability, back = read_back().observability;
  EXPECT_EQ(json::parse(without_sum(written()))["observability"]["told"], o.determined);
  ASSERT_GT(o.rows, 0);
  EXPECT_EQ(back.rows, o.rows);
  EXPECT_EQ(back.unknowns, o.unknowns);
  EXPECT_EQ(back.directions, o.directions);
  EXPECT_EQ(back.rank, o.rank);
  EXPECT_EQ(back.determined, o.determined);
  EXPECT_EQ(back.singular_values, o.singular_values);
  for (double Observability::*index :
       {&Observability::o1, &Observability::o2, &Observability::o3, &Observability::o4,
        &Observability::o5, &Observability::condition})
    EXPECT_EQ(back.*index, o.*index);
}

TEST(CalibrationJson, SettlesAfterOnce) {
  // Unit conversion rounds the last digit; a second round trip must be stable.
  const std::string once = calibration_to_json(read_back());
  const Calibration twice = calibration_from_json(once, "cal.json");
  for (std::size_t i = 0; i < twice.parameters.size(); ++i)
    EXPECT_NEAR(twice.parameters[i].correction, result().parameters[i].correction,
                1e-15 * std::abs(result().parameters[i].correction) + 1e-300);
}

TEST(CalibrationJson, KeepsARobotNameWithQuotesAndBackslashes) {
  Calibration odd = result();
  odd.cell.robot.name = "KR \"5\"\\new";
  EXPECT_EQ(calibration_from_json(calibration_to_json(odd), "cal.json").cell.robot.name,
            odd.cell.robot.name);
}

std::string refused(const json& document) {
  return refusal([&] { (void)calibration_from_json(document.dump(), "cal.json"); });
}

TEST(CalibrationJson, NamesTheKeyThatIsMissing) {
  for (const char* key :
       {"format", "robot", "cell", "parameters", "targets", "residuals", "unidentifiable",
        "predicted", "verdict", "outliers", "covariance", "frame_basis", "inputs"}) {
    json document = json::parse(without_sum(written()));
    document.erase(key);
    expect_words(refused(document), {"cal.json", key, "missing"});
  }
}

TEST(CalibrationJson, SaysWhatToDoAboutAParameterThatTheCellDoesNotHave) {
  json document = json::parse(without_sum(written()));
  document["parameters"][0]["name"] = "A9.theta";
  expect_words(refused(document), {"cal.json.parameters[0].name", "\"A9.theta\"", "not a parameter",
                                   "Identify again"});
}

TEST(CalibrationJson, KeepsTheWordsOfFilesWithoutKindsAndOfKindsThatItDoesNotKnow) {
  for (const bool unknown : {false, true}) {
    json document = json::parse(without_sum(written()));
    for (const char* list : {"outliers", "unidentifiable"})
      for (json& item : document[list]) {
        if (unknown)
          item["kind"] = "of_another_version";
        else
          item.erase("kind");
      }
    const Calibration back = calibration_from_json(document.dump(), "cal.json");
    EXPECT_EQ(back.outliers[0].kind, OutlierKind::kRecorded);
    EXPECT_EQ(words(back.outliers[0]), words(result().outliers[0]));
    EXPECT_EQ(back.unidentifiable[0].kind, UnidentifiableKind::kRecorded);
    EXPECT_EQ(words(back.cell, back.unidentifiable[0]),
              words(result().cell, result().unidentifiable[0]));
    const json again = json::parse(without_sum(calibration_to_json(back)));
    EXPECT_EQ(again["outliers"][0]["reason"], document["outliers"][0]["reason"]);
    EXPECT_EQ(again["unidentifiable"][0]["words"], document["unidentifiable"][0]["words"]);
  }
}

TEST(CalibrationJson, NamesThePlaceOfAWrongValue) {
  struct Broken {
    const char* pointer;
    json value;
    const char* place;
  };
  const json null;
  for (const auto& [pointer, value, place] : std::initializer_list<Broken>{
           {"/format", "cellcal.calibration/2", "format"},
           {"/robot", 1, "robot"},
           {"/robot/joint/0/d_mm", "long", "robot: joint[1].d_mm"},
           {"/robot/joint/0/d_mm", null, "d_mm"},
           {"/robot/surprise", 1, "surprise"},
           {"/cell/target/0/diameter_mm", -1, "target[1].diameter_mm"},
           {"/cell/target/0/diameter_mm", json::array({1}), "target[1].diameter_mm"},
           {"/model/compliance", -1, "model.compliance"},
           {"/model/considered/0/ripple_arcsec", -1, "model.considered[0].ripple_arcsec"},
           {"/predicted/nominal_m2_mm", -1, "predicted.nominal_m2_mm"},
           {"/parameters", 1, "parameters"},
           {"/parameters/0", 1, "parameters[0]"},
           {"/parameters/0/name", "A1.", "parameters[0].name"},
           {"/parameters/0/name", "A9.theta", "parameters[0].name"},
           {"/parameters/0/name", "", "parameters[0].name"},
           {"/parameters/0/name", std::string(9999, 'A'), "parameters[0].name"},
           {"/parameters/0/name", 7, "parameters[0].name"},
           {"/parameters/0/unit", "furlong", "parameters[0].unit"},
           {"/parameters/0/correction", null, "parameters[0].correction"},
           {"/parameters/0/correction", "1", "parameters[0].correction"},
           {"/parameters/0/decided_by", "dice", "parameters[0].decided_by"},
           {"/targets/0/centre_mm", json::array({1, 2}), "targets[0].centre_mm"},
           {"/residuals/after/rms_mm", null, "residuals.after.rms_mm"},
           {"/residuals/after/count", 1e300, "residuals.after.count"},
           {"/residuals/after/count", -1, "residuals.after.count"},
           {"/unidentifiable/0/direction", 1, "unidentifiable[0].direction"},
           {"/unidentifiable/0/direction", {{"A0.theta", 1.0}}, "unidentifiable[0].direction"},
           {"/unidentifiable/0/parameters", 1, "unidentifiable[0].parameters"},
           {"/unidentifiable/0/parameters/0", "S9.x", "unidentifiable[0].parameters[0]"},
           {"/unidentifiable/0/more_parameters", -1, "unidentifiable[0].more_parameters"},
           {"/chi2", -1, "chi2"},
           {"/degrees_of_freedom", null, "degrees_of_freedom"},
           {"/observability/rank", -1, "observability.rank"},
           {"/observability/o3", null, "observability.o3"},
           {"/observability/singular_values/0", -1, "observability.singular_values[0]"},
           {"/verdict/publish", "yes", "verdict.publish"},
           {"/verdict/scope", "universe", "verdict.scope"},
           {"/verdict/reasons/0", 1, "verdict.reasons[0]"},
           {"/verdict/findings", 1, "verdict.findings"},
           {"/verdict/findings/0/kind", 1, "verdict.findings[0].kind"},
           {"/verdict/findings/0/severity", "harms", "verdict.findings[0].severity"},
           {"/verdict/findings/0/about/of", "moon", "verdict.findings[0].about.of"},
           {"/verdict/findings/0/about/touch", -1, "verdict.findings[0].about.touch"},
           {"/verdict/findings/0/about/target_kind", "cone",
            "verdict.findings[0].about.target_kind"},
           {"/verdict/findings/0/evidence", 1, "verdict.findings[0].evidence"},
           {"/verdict/findings/0/evidence/lengths", 1, "verdict.findings[0].evidence.lengths"},
           {"/verdict/findings/0/evidence/lengths/value", null,
            "verdict.findings[0].evidence.lengths.value"},
           {"/verdict/findings/0/evidence/lengths/sigma", -1,
            "verdict.findings[0].evidence.lengths.sigma"},
           {"/verdict/findings/0/parts", 1, "verdict.findings[0].parts"},
           {"/outliers/0/touch", -1, "outliers[0].touch"},
           {"/outliers/0/kind", 1, "outliers[0].kind"},
           {"/outliers/0/target_kind", "cone", "outliers[0].target_kind"},
           {"/outliers/0/sigmas", -1, "outliers[0].sigmas"},
           {"/outliers/0/touch", 1e300, "outliers[0].touch"},
           {"/covariance/0/0", null, "covariance[0][0]"},
           {"/covariance/0", json::array({1}), "covariance[0]"},
           {"/covariance", json::array({1}), "covariance"},
           {"/frame_basis/1", json::array(), "frame_basis[1]"},
           {"/inputs/files/0/sha256", 1, "inputs.files[0].sha256"}}) {
    SCOPED_TRACE(pointer + (" = " + value.dump()));
    json document = json::parse(without_sum(written()));
    document[json::json_pointer(pointer)] = value;
    expect_words(refused(document), {"cal.json", place});
  }
}

TEST(CalibrationJson, RefusesACorrectionThatIsNone) {
  json document = json::parse(without_sum(written()));
  document["parameters"][0]["correction"] = 1e308;
  try {
    (void)calibration_from_json(document.dump(), "cal.json");
    FAIL() << "was read";
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("correction"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("out of range"), std::string::npos) << error.what();
  }
}

TEST(CalibrationJson, NamesWhatAPlaneOrTrackerLacks) {
  json document = json::parse(without_sum(written()));
  document["cell"].erase("length");
  json& target = document["cell"]["target"][0];
  target = {{"id", target["id"]}, {"kind", "plane"}};
  expect_words(refused(document), {"cal.json.targets[0]", "\"normal\" is missing"});
  json& found = document["targets"][0];
  found["normal"] = {0.0, 0.0, 2.0};
  expect_words(refused(document), {"cal.json.targets[0].normal", "length 1"});
  found["normal"] = {0.0, 0.0, 1.0};
  expect_words(refused(document), {"cal.json.targets[0]", "\"distance_mm\" is missing"});
  target["kind"] = "tracker";
  expect_words(refused(document), {"cal.json.targets[0]", "\"frame\" is missing"});
  found["frame"] = {{"xyz_mm", {1, 2, 3}}, {"abc_deg", {1, 2}}};
  expect_words(refused(document), {"cal.json.targets[0].frame.abc_deg", "three numbers"});
}

TEST(CalibrationJson, RefusesACalibrationThatWouldClaimMoreThanItKnows) {
  json document = json::parse(without_sum(written()));
  document["covariance"] = json::array();  // without it every bound would be zero
  expect_words(refused(document), {"cal.json", "covariance"});
  document = json::parse(without_sum(written()));
  document["parameters"][1] = document["parameters"][0];
  expect_words(refused(document), {"cal.json", "parameters[1].name", "twice"});
  document = json::parse(without_sum(written()));
  document["parameters"][0]["sigma"] = -1.0;
  expect_words(refused(document), {"cal.json", "parameters[0].sigma"});
}

TEST(CalibrationJson, RefusesACovarianceThatIsNone) {
  for (const auto& [pointer, value] : std::initializer_list<std::pair<const char*, double>>{
           {"/covariance/0/0", -1e-12}, {"/covariance/0/1", 1e-3}, {"/covariance/2/2", 1e-30}}) {
    json document = json::parse(without_sum(written()));
    document[json::json_pointer(pointer)] = value;
    expect_words(refused(document), {"cal.json.covariance", "is not a covariance"});
  }
  // Symmetric, but with a correlation above 1.
  json document = json::parse(without_sum(written()));
  const double x = document["covariance"][0][0], y = document["covariance"][1][1];
  document["covariance"][0][1] = document["covariance"][1][0] = 1.1 * std::sqrt(x * y);
  expect_words(refused(document), {"cal.json.covariance", "is not a covariance"});
}

TEST(CalibrationJson, EveryTruncationIsRefused) {
  for (std::size_t length = 0; length < written().size() - 2; length += 1 + length / 50)
    expect_words(refusal([&] {
                   (void)calibration_from_json(std::string_view(written()).substr(0, length),
                                               "cal.json");
                 }),
                 {"cal.json"});
}

TEST(CalibrationJson, NumbersThatJsonCannotHoldNeitherPassUnnoticed) {
  Calibration poisoned = result();
  poisoned.parameters[0].correction = std::nan("");
  expect_words(
      refusal([&] { (void)calibration_from_json(calibration_to_json(poisoned), "cal.json"); }),
      {"parameters[0].correction"});
}

}  // namespace
}  // namespace cellcal::calib
