#pragma once
// Parts of a calibration as its file represents them: one row per key (json_fields.h).

#include <nlohmann/json.hpp>

#include "calib/files/json.h"
#include "calib/files/json_fields.h"
#include "calib/model/parameter_key.h"
#include "calib/result/calibration.h"
#include "calib/result/finding.h"
#include "calib/result/outlier.h"
#include "calib/result/unidentifiable.h"

namespace cellcal::calib {

// Findings in calibration files: kind, severity, subject, evidence and sentence.

nlohmann::ordered_json finding_to_json(const Finding& finding);
/// An unknown kind or cause keeps its text (FindingKind::kRecorded; `text`). `cell`: the cell that
/// its parameters belong to. Throws FileError.
Finding finding_from_json(const Cell& cell, const JsonReader& item);

/// The parameter named in a file. Throws FileError if the cell does not have it.
ParameterKey parameter_from_json(const Cell& cell, const JsonReader& item);

/// A missing or unknown kind keeps its text (kRecorded; `text`).
fields::Table<Outlier> outlier_fields();
fields::Table<UnidentifiableDirection> unidentifiable_fields(const Cell& cell);
fields::Table<ResidualSummary> summary_fields();
fields::Table<ModelLevel> level_fields();
fields::Table<LevelEvidence> evidence_fields();
/// Rows of a target of `cell`, which defines its kind.
fields::Table<TargetResult> target_fields(const Cell& cell);
fields::Table<PositionerLine> positioner_fields();
fields::Table<LinearUnitLine> linear_unit_fields();
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
