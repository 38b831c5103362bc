#pragma once
// The rule by which the verdict let the calibration through, as it stands among its findings.

#include "daemon/certificate/certificate.h"
#include "daemon/certificate/sources.h"

namespace cellcal::daemon::certificate {

Decision decision_of(const Sources& sources);

}  // namespace cellcal::daemon::certificate
