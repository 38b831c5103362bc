#pragma once
// A fact of each kind, with all optional values.

#include <string>
#include <vector>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

inline std::vector<FactBody> one_of_each() {
  SessionFact session{SessionState::kFailed,
                      "calibrate",
                      "/etc/cellcal/cell.toml",
                      "kr5.toml",
                      "2026-11-22T20:00:00Z",
                      12,
                      40,
                      "no-contact",
                      "S1: no contact within 12.0 mm",
                      "1.9.0",
                      "withheld"};
  CalibrationFact calibration{"KR 5 R1400", "1234",  true, false, {"changed"},
                              0.5e-3,       0.25e-3, {},   1e-3,  "{\"a\": 1}\n"};
  CheckFact check{7, Held::kNo, 0.5e-3, 0.125e-3, "tool", 21.5, "{}"};
  TouchFact touch{3, "S1", true, {0.0, 0.5, -1.0}, std::array{1.0, 0.0, 0.5}, -0.5e-3};
  return {session,
          calibration,
          check,
          ActivationFact{"M. Huber", "tool changed\nback to 7"},
          CertificateFact{
              "7-abc",
              {{"certificate.json", "{}"}, {"certificate.sums.sig", std::string("\0\xff\x80", 3)}}},
          AlarmFact{"drifted", "weld-3: drifted", "0.4 mm"},
          AnswerFact{"p-1", true, "policy", ""},
          PhaseFact{"search", "latch", "contact", 12.5},
          touch,
          HealthFact{100, 1, 2, 99, 0.0, 0.5, 10, 1, 0.25, 4, 1 << 20},
          DroppedFact{7, 7, 1, DropReason::kTooLarge, "certificate", 9000000}};
}

inline Fact fact_of(const FactBody& body) {
  return {{"graz", "weld-3"}, "0123abcd", 17, "2026-11-22T20:51:17.123Z", 7, body};
}

}  // namespace cellcal::daemon::plant
