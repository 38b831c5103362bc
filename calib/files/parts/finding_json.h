#pragma once
// Findings as calibration files hold them: kind, severity, subject, evidence and words.

#include <nlohmann/json.hpp>

#include "calib/result/finding.h"
#include "calib/syntax/json_reader.h"

namespace cellcal::calib {

nlohmann::ordered_json finding_to_json(const Finding& finding);
/// Of a kind or cause that this version does not know its words are kept (FindingKind::kRecorded;
/// `text`). `cell`: that its parameters are of. Throws FileError.
Finding finding_from_json(const Cell& cell, const JsonReader& item);

}  // namespace cellcal::calib
