#include "tests/daemon/certificate/recorded.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/files/calibration_json.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/planned_round.h"
#include "tests/calib/simulate.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {

namespace {

SessionInputs inputs_of(const Recording& what) {
  SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
  const std::string id = "id = \"S1\"\n";
  inputs.cell_text.insert(inputs.cell_text.find(id) + id.size(), what.certificate);
  inputs.cell_text += "\n" + what.identity;
  if (!what.lengths) {
    const std::size_t first = inputs.cell_text.find("[[length]]");
    inputs.cell_text.erase(first, inputs.cell_text.find("[touch]") - first);
  }
  if (what.check_length) {
    inputs.cell_text.insert(inputs.cell_text.find('\n', inputs.cell_text.rfind("[[length]]")) + 1,
                            "role = \"check\"\ncertificate = \"CHECKED-2\"\n");
    inputs.cell_text.insert(inputs.cell_text.find("[[length]]") + std::string("[[length]]").size(),
                            "\ncertificate = \"FITTED-1\"");
  }
  if (what.longer_tool_m > 0.0) {
    const std::string z = "410.3]";
    inputs.cell_text.replace(inputs.cell_text.find(z), z.size(),
                             fmt::format("{}]", 410.3 + 1e3 * what.longer_tool_m));
  }
  SessionOptions options;
  options.emulated = what.emulated;
  inputs.options = options_to_json(options);
  return inputs;
}

RecordChange change(Phase from, Phase to, EventKind on, const std::string& utc) {
  return {{from, to}, on, utc, 1.0, 0, 0.0};
}

/// A silence of the robot, resumed two hours later.
void interrupt(Journal& journal, std::int64_t session) {
  journal.note(session,
               change(Phase::kIdle, Phase::kPlanning, EventKind::kRun, "2026-03-28T22:58:01.000Z"));
  journal.note(session, change(Phase::kRetreat, Phase::kFailed, EventKind::kRobotSilent,
                               "2026-03-28T23:10:00.250Z"));
  journal.record(session, RecordEnd{Ending::kFailed, "no packet for 44 ms"},
                 "2026-03-28T23:10:01.000Z");
  journal.resume(session, "2026-03-29T01:25:00.000Z");
  journal.note(session,
               change(Phase::kIdle, Phase::kPlanning, EventKind::kRun, "2026-03-29T01:25:00.125Z"));
}

}  // namespace

std::int64_t record(Journal& journal, const Recording& what, bool against_the_last) {
  const SessionInputs inputs = inputs_of(what);
  const std::int64_t id = journal.begin(inputs, "2026-03-28T22:58:00.000Z");
  const calib::Cell cell = cell_of(inputs);
  // The same arm; its earlier corrections are slightly smaller.
  auto touches =
      calib::testing::make_touches(
          cell, calib::testing::plain_truth(cell, 3),
          {.fit = what.fit, .check = 10, .rho_m = 2e-4, .speed_m_s = 0.002, .seed = what.seed})
          .touches;
  std::erase_if(touches, [&](const calib::Touch& one) { return one.target == what.untouched; });
  if (what.gross_check)
    std::ranges::find(touches.rbegin(), touches.rend(), calib::TouchSet::kCheck, &calib::Touch::set)
        ->joint_rad[0] += 0.005;
  for (int i = 0; i < what.repeats; ++i) {
    touches.push_back(touches.front());
    touches.back().joint_rad[0] += 1e-5 * (i % 2 == 0 ? i + 1 : -i);
  }
  if (what.phases)
    journal.note(
        id, change(Phase::kIdle, Phase::kPlanning, EventKind::kRun, "2026-03-28T22:58:01.000Z"));
  if (what.interrupted) interrupt(journal, id);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    calib::Touch& touch = touches[i];
    touch.joint_rad[1] += what.remastered_rad;
    touch.time = fmt::format("2026-03-29T01:{:02}:{:02}.000Z", 26 + i / 60, i % 60);
    touch.readings = 2;
    if (what.temperatures) touch.temperature_c = 21.0 + 0.037 * static_cast<double>(i);
    calib::Touch kept = touch;
    if (what.as_fit) kept.set = calib::TouchSet::kFit;
    journal.record(id, RecordTouch{i, kept});
  }
  const auto compared =
      against_the_last ? last_calibration(journal, inputs.cell_name, id, true) : std::nullopt;
  calib::Calibration calibration = estimate(cell, inputs, touches, compared);
  if (!what.publish) {
    calibration.verdict.judged = false;
    calibration.verdict.findings.insert(calibration.verdict.findings.begin(),
                                        calib::Finding{calib::FindingKind::kAllLeftOut});
  }
  if (!what.stands_on.empty()) {
    calibration.update.emplace();
    calibration.update->outcome = calib::UpdateOutcome::kUpdated;
    calibration.update->stands_on = what.stands_on;
  }
  if (what.forged_publish) {
    calibration.verdict.judged = true;
    std::erase_if(calibration.verdict.findings, [](const calib::Finding& one) {
      return one.severity == calib::Severity::kWithholds;
    });
  }
  if (what.forged_figures) {
    calibration.predicted_workspace_m /= 10.0;
    calibration.predicted_near_targets_m /= 10.0;
  }
  if (what.positioner) {
    calib::PositionerLine line;
    line.axis = "E1";
    line.point_m = {1.1502, 0.0, 0.4};
    line.direction = {0.0, -1.0, 0.0};
    line.place_u95_m = 2.5e-5;
    line.direction_u95_rad = 6.1e-5;
    calibration.positioner.push_back(line);
  }
  if (what.linear_unit) {
    calib::LinearUnitLine line;
    line.axis = "E1";
    line.direction = {0.0, -1.0, 0.0};
    line.direction_u95_rad = 8.1e-5;
    line.scale = -2.34e-5;
    line.scale_u95 = 4.1e-6;
    line.at.push_back(
        {0.25, {1e-5, 2e-5, 3e-5, 4e-5, 5e-5, 6e-5}, {1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6}});
    line.at.push_back({3.0, {}, {}});
    calibration.linear_unit = line;
  }
  journal.store_calibration(id, calib::calibration_to_json(calibration), compared);
  RecordEnd end{what.ending, ""};
  if (what.ending == Ending::kDone)
    end.result = std::make_shared<const SessionResult>(SessionResult{calibration});
  journal.record(id, end, "2026-03-29T01:31:00.000Z");
  return id;
}

const Recorded& recorded() {
  static const Recorded made = [] {
    const TemporaryDirectory directory;
    Journal journal(directory / "j.db");
    const Recording first{
        .identity =
            "[identity]\nsite = \"Hall 3\"\noperator = \"J\u00fcrgen \u00c4.\"\nrobot_serial = \"4711\"\n"
            "controller_serial = \"KRC 8\"\nsensor = \"board C\"\nsensor_serial = \"0007\"\n",
        .certificate =
            "serial = \"K 1\"\ncertificate = \"D-K-15070 412\"\ncertificate_date = \"2026-04-01\"\n",
        .interrupted = true,
        .temperatures = true};
    const std::int64_t one = record(journal, first, false);
    const std::int64_t two = record(journal, {.phases = true, .fit = 60, .seed = 2}, true);
    return Recorded{make_archive(journal, one, directory / "none"),
                    make_archive(journal, two, directory / "none")};
  }();
  return made;
}

}  // namespace cellcal::daemon::testing
