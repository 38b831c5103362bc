#pragma once
// Touches that were left out as calibration files hold them: how far they are off, kind, evidence
// and words.

#include <nlohmann/json.hpp>

#include "calib/result/outlier.h"
#include "calib/syntax/json_reader.h"

namespace cellcal::calib {

nlohmann::ordered_json outlier_to_json(const Outlier& outlier);
/// Of a file without kinds, and of a kind that this version does not know, the words are kept
/// (OutlierKind::kRecorded). Throws FileError.
Outlier outlier_from_json(const JsonReader& item);

}  // namespace cellcal::calib
