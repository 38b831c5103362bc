#pragma once
// What a calibration holds, part by part, as its file has it: one row per key (json_fields.h).

#include "calib/files/json_fields.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

fields::Table<ResidualSummary> summary_fields();
fields::Table<ModelLevel> level_fields();
fields::Table<LevelEvidence> evidence_fields();
/// Of a target of that cell, which knows its kind.
fields::Table<TargetResult> target_fields(const Cell& cell);
fields::Table<Observability> observability_fields();
fields::Table<Discrepancy> discrepancy_fields();
fields::Table<RepeatedTouches> repeats_fields();
/// Of a calibration of that cell.
fields::Table<Verdict> verdict_fields(const Cell& cell);
fields::Table<LengthResult> length_fields();
fields::Table<MovedTarget> moved_fields();
fields::Table<Jump> jump_fields();
fields::Table<InputFile> input_fields();

// Parameters, their covariance and the frame directions as a calibration file has them: in the
// parameters' own units, matrices in the order of the parameters.

/// "parameters"; the cell is read before.
fields::Field<Calibration> parameters_field();
/// "covariance", "frame_basis"; the parameters are read before.
fields::Field<Calibration> covariance_field();
fields::Field<Calibration> frame_basis_field();

}  // namespace cellcal::calib
