#pragma once
// Parts of a calibration as its file represents them: one row per key (json_fields.h).

#include "calib/files/json_fields.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

fields::Table<ResidualSummary> summary_fields();
fields::Table<ModelLevel> level_fields();
fields::Table<LevelEvidence> evidence_fields();
/// Rows of a target of `cell`, which defines its kind.
fields::Table<TargetResult> target_fields(const Cell& cell);
fields::Table<PositionerLine> positioner_fields();
fields::Table<Observability> observability_fields();
fields::Table<Discrepancy> discrepancy_fields();
fields::Table<RepeatedTouches> repeats_fields();
/// Rows of the verdict on a calibration of `cell`.
fields::Table<Verdict> verdict_fields(const Cell& cell);
fields::Table<UncertaintyLine> uncertainty_fields();
fields::Table<LengthResult> length_fields();
fields::Table<MovedTarget> moved_fields();
fields::Table<Jump> jump_fields();
fields::Table<InputFile> input_fields();

// Parameters, their covariance and the frame directions in a calibration file: in the parameters'
// own units, matrices in the order of the parameters.

/// "parameters"; requires the cell.
fields::Field<Calibration> parameters_field();
/// "covariance", "frame_basis"; require the parameters.
fields::Field<Calibration> covariance_field();
fields::Field<Calibration> frame_basis_field();

}  // namespace cellcal::calib
