#pragma once
// What a calibration holds, part by part, as its file has it: one row per key (json_fields.h).

#include "calib/result/calibration.h"
#include "calib/syntax/json_fields.h"

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

}  // namespace cellcal::calib
