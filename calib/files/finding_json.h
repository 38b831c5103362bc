#pragma once
// Findings in calibration files: kind, severity, subject, evidence and sentence.

#include <nlohmann/json.hpp>

#include "calib/files/json.h"
#include "calib/model/parameter_key.h"
#include "calib/result/finding.h"
#include "calib/result/outlier.h"
#include "calib/result/unidentifiable.h"

namespace cellcal::calib {

nlohmann::ordered_json finding_to_json(const Finding& finding);
/// An unknown kind or cause keeps its text (FindingKind::kRecorded; `text`). `cell`: the cell that
/// its parameters belong to. Throws FileError.
Finding finding_from_json(const Cell& cell, const JsonReader& item);

// Touches left out, in calibration files: deviation, kind, evidence and sentence.

nlohmann::ordered_json outlier_to_json(const Outlier& outlier);
/// A missing or unknown kind keeps its text (OutlierKind::kRecorded). Throws FileError.
Outlier outlier_from_json(const JsonReader& item);

// Undetermined directions in calibration files, with parameters by name.

/// The parameter named in a file. Throws FileError if the cell does not have it.
ParameterKey parameter_from_json(const Cell& cell, const JsonReader& item);

nlohmann::ordered_json unidentifiable_to_json(const Cell& cell,
                                              const UnidentifiableDirection& direction);
/// A missing or unknown kind keeps its text (UnidentifiableKind::kRecorded). Throws FileError.
UnidentifiableDirection unidentifiable_from_json(const Cell& cell, const JsonReader& item);

}  // namespace cellcal::calib
