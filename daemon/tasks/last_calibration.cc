#include "daemon/tasks/last_calibration.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "calib/files/calibration_json.h"

namespace cellcal::daemon {

std::optional<Compared> last_calibration(Journal& journal, const std::string& cell_name,
                                         std::int64_t before, bool accepted) {
  for (const SessionRecord& session : journal.sessions()) {
    if (session.id >= before || session.origin) continue;
    if (session.state != "done" || session.inputs.cell_name != cell_name) continue;
    constexpr std::size_t kDate = 10;  // YYYY-MM-DD
    Compared last{fmt::format("session {} of {}", session.id, session.ended.substr(0, kDate)),
                  accepted, ""};
    try {
      const auto whole = journal.session(session.id);
      if (!whole || whole->calibration.empty()) continue;
      last.calibration = whole->calibration;
      if (calib::calibration_from_json(last.calibration, last.words).verdict.publish) return last;
    } catch (const std::runtime_error& error) {  // of another version, or damaged
      spdlog::warn("not compared with {}: {}", last.words, error.what());
    }
  }
  return {};
}

}  // namespace cellcal::daemon
