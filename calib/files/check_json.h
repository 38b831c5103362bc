#pragma once
// A check as a document: "cellcal.check/1", millimetres and degrees, with its sentences.

#include <string>

#include "calib/result/drift_chart.h"
#include "calib/result/tcp_check.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

std::string check_to_json(const TcpCheck& check);

// A control chart as a document: "cellcal.drift/1", millimetres, with its sentences.

/// `language`: of its events' words.
std::string drift_to_json(const DriftChart& chart, const Language& language = {});

}  // namespace cellcal::calib
