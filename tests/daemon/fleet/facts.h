#pragma once
// Facts of the cells in these tests.

#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"
#include "tests/daemon/fleet/servers.h"

namespace cellcal::daemon::fleet::testing {

inline const plant::CellName kWeld{"graz", "weld-3"}, kPaint{"graz", "paint-1"};

inline std::string a_calibration() {
  std::ifstream in(CELLCAL_CALIBRATION, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline std::vector<plant::FactBody> one_of_each() {
  using namespace plant;
  return {
      SessionFact{SessionState::kDone, "calibrate", "/etc/cellcal/cell.toml", "kr5.toml",
                  "2026-11-22T20:00:00Z", 40, 40, "", "", "1.9.0"},
      CalibrationFact{
          "KR 5 R1400", "1234", true, false, {}, 0.5e-3, 0.25e-3, 0.125e-3, 1e-3, a_calibration()},
      CheckFact{1, Held::kYes, 0.5e-3, 0.125e-3, "", 21.5, "{\"a\": 1}\n"},
      ActivationFact{"M. Huber", "tool changed\nback to 7"},
      CertificateFact{"7-abc",
                      {{"certificate.json", "{}"}, {"sums.sig", std::string("\0\xff\x80", 3)}}},
      AlarmFact{"done", "weld-3: done", "0.4 mm"},
      AnswerFact{"p-1", true, "policy", ""},
      PhaseFact{"search", "latch", "contact", 12.5},
      TouchFact{3, "S1", true, {0.0, 0.5, -1.0}, std::array{1.0, 0.0, 0.5}, -0.5e-3},
      HealthFact{100, 1, 2, 99, 0.0, 0.5, 10, 1, 0.25, 4, 1 << 20},
      DroppedFact{4, 3, 0}};
}

inline const char* const kTables[] = {"session_facts", "calibrations", "checks",  "activations",
                                      "certificates",  "alarms",       "answers", "phases",
                                      "touches",       "health",       "drops"};

inline plant::Fact fact(const plant::CellName& of, std::int64_t number, plant::FactBody body,
                        std::int64_t session = 7) {
  return {of, "j1", number, "2026-11-22T20:51:17.123Z", session, std::move(body)};
}

inline Publication publication(const plant::Fact& one) {
  return {plant::to_text({one.of, plant::Subject::kFact, plant::kind_of(one.body)}),
          plant::to_json(one)};
}

inline plant::Fact alarm(const plant::CellName& of, std::int64_t number) {
  return fact(of, number, plant::AlarmFact{"done", "done", "done"});
}

/// Number of rows of each kind.
inline std::string count_of_each(const std::string& database) {
  std::string sql;
  for (const char* table : kTables)
    sql += (sql.empty() ? "SELECT " : ", ") +
           ("(SELECT count(*) FROM fleet." + std::string(table) + ")");
  return ask(database, sql);
}

}  // namespace cellcal::daemon::fleet::testing
