#pragma once
// A check as a document: "cellcal.check/1", millimetres and degrees, with its words.

#include <string>

#include "calib/result/tcp_check.h"

namespace cellcal::calib {

std::string check_to_json(const TcpCheck& check);

}  // namespace cellcal::calib
