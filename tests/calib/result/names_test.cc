// Names of enumerators that files and interfaces have: a renamed enumerator must not change a format.

#include <gtest/gtest.h>

#include <string>

#include "calib/model/enum_table.h"
#include "calib/result/calibration.h"
#include "calib/result/drift_chart.h"

namespace cellcal::calib {
namespace {

template <class E>
std::string names() {
  std::string all;
  for (const E one : all_values<E>()) {
    all += (all.empty() ? "" : " ") + std::string(own_name(one));
    EXPECT_EQ(by_own_name<E>(own_name(one)), one);
  }
  EXPECT_FALSE(by_own_name<E>("gremlins"));
  return all;
}

TEST(OwnNames, AreThoseOfTheFormats) {
  EXPECT_EQ(names<FindingKind>(),
            "touch_scatter duplicate_touches many_outliers outliers_of_target check_touches "
            "gross_check_touches no_check_touches unseen_place unseen_not_judged temperature "
            "model_error too_few_touches rank too_few_directions all_left_out not_touched "
            "certified_length certified_twice artefact_size stated_centre exchanged_centres "
            "negative_compliance arm_scale off_nominal effective_radius scale_by_lengths "
            "scale_by_readings scale_by_nothing scope_of_touches unchecked_readings "
            "unchecked_touch unchecked_lengths unchecked_length required no_gain gain "
            "controller_model changed change_accepted unchanged not_compared updated "
            "update_not_needed update_contradicted update_not_resolved update_not_found "
            "update_too_few not_identified likely_cause moved_target jumped "
            "still_with_model_error reference_method recorded");
  EXPECT_EQ(names<Severity>(), "withholds warns informs");
  EXPECT_EQ(names<Subject::Of>(),
            "session touch target joint tool length parameter robot positioner");
  EXPECT_EQ(names<LikelyCause>(),
            "radians axis_sign mastering exchanged_columns target_names scattered_touches "
            "readings_unit readings_handedness moved tool_unit tool_tip dimension other_robot "
            "axis_convention gravity all_diameters diameter artefact_size certified_length "
            "exchanged_lengths lengths_of_target all_lengths stated_centre all_centres "
            "lengths_unit");
  EXPECT_EQ(names<OutlierKind>(), "off_its_target on_another_target holds_itself recorded");
  EXPECT_EQ(names<UnidentifiableKind>(),
            "zero_of_first_joint height_of_base behind_last_joint nothing_moves no_effect scale "
            "weak recorded");
  EXPECT_EQ(names<ChangeKind>(), "nothing tool sphere joint growth touch positioner");
  EXPECT_EQ(names<CheckVerdict>(), "holds does_not_hold undecided");
  EXPECT_EQ(names<UpdateOutcome>(),
            "updated nothing_changed contradicted not_resolved not_found too_few_touches");
  EXPECT_EQ(names<UncertaintySource>(),
            "touches certified_lengths diameters effective_radius latch_delay tool arm_lengths "
            "arm_angles linear_unit transmission loads places ripple model");
  EXPECT_EQ(names<DecidedBy>(), "data prior frame");
  EXPECT_EQ(names<Jump::What>(), "joint tool target");
  EXPECT_EQ(names<DriftAdvice>(), "none check_again let_it_warm_up re_measure_tcp recalibrate");
  EXPECT_EQ(names<LeftOut>(), "no undecided incomplete not_the_tool other_touches");
  EXPECT_EQ(names<DriftState>(), "too_few in_control warns alarms unknown");
  EXPECT_EQ(names<Holding>(), "holds does_not_hold unknown");
  EXPECT_EQ(names<DriftEventKind>(), "calibrated updated activated");
  EXPECT_EQ(names<TargetKind>(), "sphere wire plane point tracker");
  EXPECT_EQ(names<UnseenTarget::NotJudged>(), "place_alone no_place unusable other_normal");
  EXPECT_EQ(names<DriftShape>(), "step creep");
}

TEST(OwnNames, OfAValueWithoutAnEnumerator) {
  EXPECT_STREQ(own_name(static_cast<Severity>(99)), "unknown");
}

}  // namespace
}  // namespace cellcal::calib
