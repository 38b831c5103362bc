#include "daemon/config/pendant.h"

namespace cellcal::daemon {

const char* what_to_start(WireKind wire) {
  switch (wire) {
    case WireKind::kRsi:
      return "start CELLCAL_RSI on the pendant: release emergency stops, acknowledge messages, "
             "drives on, select it and start it (in T1 hold the enabling switch and the start key)";
    case WireKind::kEki:
      break;
  }
  return "start CELLCAL_EKI on the pendant: CELLCAL_SUB must run in the submit interpreter; release "
         "emergency stops, acknowledge messages, drives on, select CELLCAL_EKI and start it (in T1 "
         "hold the enabling switch and the start key)";
}

}  // namespace cellcal::daemon
