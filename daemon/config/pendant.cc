#include "daemon/config/pendant.h"

namespace cellcal::daemon {

const char* what_to_start(WireKind wire) {
  switch (wire) {
    case WireKind::kRsi:
      return "start CELLCAL_RSI on the pendant: release emergency stops, acknowledge messages, "
             "switch drives on, select and start it (in T1 hold enabling switch and start key)";
    case WireKind::kEki:
      break;
  }
  return "start CELLCAL_EKI on the pendant: check that CELLCAL_SUB runs in the submit "
         "interpreter, release emergency stops, acknowledge messages, switch drives on, select "
         "CELLCAL_EKI and start it (in T1 hold enabling switch and start key)";
}

}  // namespace cellcal::daemon
