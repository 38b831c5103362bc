#include "calib/result/likely_cause.h"

#include "calib/result/names.h"

namespace cellcal::calib {

namespace {

constexpr std::array kCauses = {
    Named{LikelyCause::kRadians, "radians"},
    Named{LikelyCause::kAxisSign, "axis_sign"},
    Named{LikelyCause::kMastering, "mastering"},
    Named{LikelyCause::kExchangedColumns, "exchanged_columns"},
    Named{LikelyCause::kTargetNames, "target_names"},
    Named{LikelyCause::kScatteredTouches, "scattered_touches"},
    Named{LikelyCause::kReadingsUnit, "readings_unit"},
    Named{LikelyCause::kReadingsHandedness, "readings_handedness"},
    Named{LikelyCause::kMoved, "moved"},
    Named{LikelyCause::kToolUnit, "tool_unit"},
    Named{LikelyCause::kToolTip, "tool_tip"},
    Named{LikelyCause::kDimension, "dimension"},
    Named{LikelyCause::kOtherRobot, "other_robot"},
    Named{LikelyCause::kAxisConvention, "axis_convention"},
    Named{LikelyCause::kGravity, "gravity"},
    Named{LikelyCause::kAllDiameters, "all_diameters"},
    Named{LikelyCause::kDiameter, "diameter"},
    Named{LikelyCause::kArtefactSize, "artefact_size"},
    Named{LikelyCause::kCertifiedLength, "certified_length"},
    Named{LikelyCause::kExchangedLengths, "exchanged_lengths"},
    Named{LikelyCause::kLengthsOfTarget, "lengths_of_target"},
    Named{LikelyCause::kAllLengths, "all_lengths"},
    Named{LikelyCause::kStatedCentre, "stated_centre"},
    Named{LikelyCause::kAllCentres, "all_centres"},
};

}  // namespace

const char* to_string(LikelyCause cause) { return name_of(kCauses, cause); }
std::optional<LikelyCause> likely_cause(const std::string& name) { return named(kCauses, name); }

}  // namespace cellcal::calib
