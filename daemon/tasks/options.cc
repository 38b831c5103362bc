#include "daemon/tasks/options.h"

#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/identify/update.h"
#include "calib/model/long_work.h"
#include "calib/verdict/change.h"

template <>
struct nlohmann::adl_serializer<std::optional<double>> {
  static void to_json(json& value, const std::optional<double>& number) {
    value = number ? json(*number) : json(nullptr);
  }
  static void from_json(const json& value, std::optional<double>& number) {
    number = value.is_null() ? std::nullopt : std::optional(value.get<double>());
  }
};

namespace cellcal::daemon {

// Form used by the journal.
void to_json(nlohmann::json& json, SessionKind kind) { json = to_string(kind); }
void from_json(const nlohmann::json& json, SessionKind& kind) {
  const auto known = session_kind(json.get<std::string>());
  if (!known)
    throw std::runtime_error("stored session options: kind " + json.dump() +
                             " is of another version");
  kind = *known;
}

namespace {

/// One list of keys for both directions. `visit` is called with each key and its member.
template <typename Options, typename Visitor>
void each_key(Options& options, Visitor visit) {
  visit("fit_touches", options.plan.fit_touches);
  visit("check_touches", options.plan.check_touches);
  visit("seed", options.plan.seed);
  visit("standoff_m", options.plan.standoff_m);
  visit("beyond_m", options.plan.beyond_m);
  visit("clear_m", options.plan.clear_m);
  visit("limit_margin_rad", options.plan.limit_margin_rad);
  visit("fast_m_s", options.touch.fast_m_s);
  visit("slow_m_s", options.touch.slow_m_s);
  visit("back_off_m", options.touch.back_off_m);
  visit("earliest_m", options.touch.earliest_m);
  visit("readings", options.touch.readings);
  visit("tolerance_m", options.touch.tolerance_m);
  visit("max_readings", options.touch.max_readings);
  visit("max_revoked", options.touch.max_revoked);
}

/// Keys missing in sessions of earlier versions.
template <typename Options, typename Visitor>
void each_later_key(Options& options, Visitor visit) {
  visit("kind", options.kind);
  visit("target", options.target);
  visit("against", options.against);
  visit("temperature_c", options.temperature_c);
  visit("mastered", options.mastered);
  visit("region", options.region);
  visit("one_by_one", options.one_by_one);
  visit("goal_u95_m", options.goal.u95_m);
  visit("goal_most_touches", options.goal.most_touches);
  visit("goal_worth_it", options.goal.worth_it);
  visit("find", options.find);
  visit("load", options.load);
  visit("accept_change", options.accept_change);
  visit("update", options.update);
  visit("months", options.months);
  visit("emulated", options.emulated);
  visit("slow_back_off_m", options.touch.slow_back_off_m);
  visit("beyond_first_m", options.touch.beyond_first_m);
  visit("max_failed_in_a_row", options.touch.max_failed_in_a_row);
  visit("max_failed", options.touch.max_failed);
  visit("confirm_every", options.touch.confirm_every);
  visit("surprise_sigmas", options.touch.surprise_sigmas);
  visit("most_bounces", options.touch.most_bounces);
  visit("most_stamp_m", options.touch.most_stamp_m);
  visit("approach_sigmas", options.touch.approach_sigmas);
  visit("approach_margin_m", options.touch.approach_margin_m);
  visit("approach_least_m", options.touch.approach_least_m);
  visit("behind_nominal_m", options.touch.behind_nominal_m);
}

std::vector<calib::InputFile> files_of(const calib::Cell& cell, const SessionInputs& inputs,
                                       const std::vector<calib::Touch>& touches) {
  const std::string csv = calib::format_touches(touches, cell.robot);
  return {{"cell", inputs.cell_name, calib::sha256(inputs.cell_text)},
          {"robot", inputs.robot_name, calib::sha256(inputs.robot_text)},
          {"touches", "touches.csv", calib::sha256(csv)}};
}

}  // namespace

std::string options_to_json(const SessionOptions& options) {
  nlohmann::json json;
  const auto put = [&](const char* key, const auto& value) { json[key] = value; };
  each_key(options, put);
  each_later_key(options, put);
  return json.dump();
}

SessionOptions options_from_json(std::string_view text) {
  SessionOptions options;
  // Behaviour of earlier versions.
  options.touch.confirm_every = 1;
  options.touch.behind_nominal_m = 0.0;
  const nlohmann::json json = calib::parse_json(text);
  if (!json.is_object()) throw std::runtime_error("stored session options: not a JSON object");
  const auto read = [&](const char* key, auto& value) {
    try {
      json.at(key).get_to(value);
    } catch (const nlohmann::json::exception&) {
      throw std::runtime_error(std::string("stored session options: ") + key +
                               ": missing, or of another type");
    }
  };
  each_key(options, read);
  each_later_key(options, [&](const char* key, auto& value) {
    if (json.contains(key)) read(key, value);
  });
  options.plan.region = calib::parse_accuracy_region(options.region);
  return options;
}

std::optional<SessionOptions> options_in(const SessionInputs& inputs) try {
  return options_from_json(inputs.options);
} catch (const std::runtime_error&) {
  return std::nullopt;
}

SessionInputs read_inputs(const std::filesystem::path& cell_file) {
  calib::CellText text = calib::read_cell_text(cell_file);
  calib::parse_cell(text);  // an invalid cell must not be used to begin
  SessionInputs inputs;
  inputs.cell_name = std::move(text.cell_name);
  inputs.cell_text = std::move(text.cell_text);
  inputs.robot_name = std::move(text.robot_name);
  inputs.robot_text = std::move(text.robot_text);
  return inputs;
}

calib::Cell cell_of(const SessionInputs& inputs) {
  return calib::parse_cell(
      {inputs.cell_name, inputs.cell_text, inputs.robot_name, inputs.robot_text});
}

std::optional<ContactDelay> delay_of(Journal& journal, std::int64_t session) {
  const std::optional<SessionRecord> record = journal.session(session);
  if (!record) return std::nullopt;
  const auto options = options_in(record->inputs);  // none: its speeds are unknown
  // A qualification's searches have speeds of their own, and it reports the delay itself.
  if (!options || options->kind == SessionKind::kQualify) return std::nullopt;
  return contact_delay(fast_and_slow(journal.readings(session), journal.touches(session).size()),
                       options->touch.fast_m_s, options->touch.slow_m_s);
}

std::optional<ContactDelay> delay_before(Journal& journal, std::int64_t session) {
  const std::optional<SessionRecord> record = journal.session(session);
  if (!record) return std::nullopt;
  for (const SessionRecord& earlier : journal.sessions()) {
    calib::poll_cancelled();
    if (earlier.id >= session || earlier.origin ||
        earlier.inputs.robot_name != record->inputs.robot_name)
      continue;
    try {
      if (const auto delay = delay_of(journal, earlier.id)) return delay;
    } catch (const JournalError& damaged) {
      spdlog::warn("not compared with session {}: {}", earlier.id, damaged.what());
    }
  }
  return std::nullopt;
}

void watch_delay(Journal& journal, std::int64_t session, const std::string& utc) {
  try {
    const std::optional<ContactDelay> delay = delay_of(journal, session);
    if (!delay) return;
    const std::string words = "latch delay: " + in_words(*delay);
    journal.note(session, utc, words);
    spdlog::info("session {}: {}", session, words);
    const std::string wrong = complaint(*delay, delay_before(journal, session));
    if (wrong.empty()) return;
    journal.note(session, utc, "warning: " + wrong);
    spdlog::warn("session {}: {}", session, wrong);
  } catch (const std::exception& error) {
    spdlog::warn("session {}: latch delay not estimated: {}", session, error.what());
  }
}

calib::Calibration estimate(const calib::Cell& cell, const SessionInputs& inputs,
                            const std::vector<calib::Touch>& touches,
                            const std::optional<Compared>& compared) {
  calib::Calibration calibration =
      calib::identify(cell, touches, {.region_poses = calib::kStatedPoses}, calib::shipped_robots);
  if (compared) {
    calib::judge_change(calib::calibration_from_json(compared->calibration, compared->words),
                        compared->words, compared->accepted, touches, calibration);
  }
  calibration.inputs = files_of(cell, inputs, touches);
  return calibration;
}

calib::Calibration estimate_update(const SessionInputs& inputs,
                                   const std::vector<calib::Touch>& touches, const Compared& last,
                                   double months, const std::vector<std::string>& not_found) {
  calib::Calibration calibration =
      calib::update(calib::calibration_from_json(last.calibration, last.words), touches,
                    {last.words, months, not_found, calib::kStatedPoses});
  calibration.inputs = files_of(calibration.cell, inputs, touches);
  calibration.inputs.push_back({"last calibration", last.words, calib::sha256(last.calibration)});
  return calibration;
}

}  // namespace cellcal::daemon
