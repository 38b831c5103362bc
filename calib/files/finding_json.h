#pragma once
// Findings as calibration files hold them: kind, severity, subject, evidence and words.

#include <nlohmann/json.hpp>

#include "calib/files/json.h"
#include "calib/model/parameter_key.h"
#include "calib/result/finding.h"
#include "calib/result/outlier.h"
#include "calib/result/unidentifiable.h"

namespace cellcal::calib {

nlohmann::ordered_json finding_to_json(const Finding& finding);
/// Of a kind or cause that this version does not know its words are kept (FindingKind::kRecorded;
/// `text`). `cell`: that its parameters are of. Throws FileError.
Finding finding_from_json(const Cell& cell, const JsonReader& item);

// Touches that were left out as calibration files hold them: how far they are off, kind, evidence
// and words.

nlohmann::ordered_json outlier_to_json(const Outlier& outlier);
/// Of a file without kinds, and of a kind that this version does not know, the words are kept
/// (OutlierKind::kRecorded). Throws FileError.
Outlier outlier_from_json(const JsonReader& item);

// What touches do not decide as calibration files hold it, and parameters by their names.

/// The parameter that a name in a file stands for. Throws FileError where the cell has none.
ParameterKey parameter_from_json(const Cell& cell, const JsonReader& item);

nlohmann::ordered_json unidentifiable_to_json(const Cell& cell,
                                              const UnidentifiableDirection& direction);
/// Of a file without kinds, and of a kind that this version does not know, the words are kept
/// (UnidentifiableKind::kRecorded). Throws FileError.
UnidentifiableDirection unidentifiable_from_json(const Cell& cell, const JsonReader& item);

}  // namespace cellcal::calib
