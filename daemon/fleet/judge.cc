#include "daemon/fleet/judge.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "calib/model/error.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::fleet {

namespace {

constexpr double kDay_s = 86'400.0;
/// Names beyond that share one meter, so that invented names use no memory.
constexpr std::size_t kMostCells = 20'000;

}  // namespace

Meters::Meter& Meters::meter_of(const plant::CellName& cell, Time now) {
  const auto known = meters_.find(cell);
  if (known != meters_.end()) return known->second;
  const Meter full{allowance_.burst, allowance_.bytes_per_day, now};
  return meters_.try_emplace(meters_.size() < kMostCells ? cell : plant::CellName{}, full)
      .first->second;
}

bool Meters::allows(const plant::CellName& cell, std::size_t bytes, Time now) {
  Meter& meter = meter_of(cell, now);
  const double passed_s = std::max(0.0, std::chrono::duration<double>(now - meter.at).count());
  meter.at = now;
  meter.messages =
      std::min(allowance_.burst, meter.messages + passed_s * allowance_.messages_per_s);
  meter.bytes = std::min(allowance_.bytes_per_day,
                         meter.bytes + passed_s * allowance_.bytes_per_day / kDay_s);
  const auto size = static_cast<double>(bytes);
  if (meter.messages < 1.0 || meter.bytes < size) return false;
  meter.messages -= 1.0;
  meter.bytes -= size;
  return true;
}

namespace {

using plant::Subject;
using plant::Topic;

bool is_digit(char c) { return '0' <= c && c <= '9'; }

int number_at(std::string_view text, std::size_t from, std::size_t count) {
  int value = 0;
  for (const char c : text.substr(from, count)) value = 10 * value + (c - '0');
  return value;
}

void require_time(const std::string& time) {
  if (!is_time(time))
    throw calib::FileError("time: \"" + printable(time) +
                           "\" must be like 2026-11-22T20:51:17.123Z");
}

void read(const Message& message, const Topic& topic, Batch& batch) {
  if (topic.subject == Subject::kPresence) {
    plant::Presence presence = plant::presence_from_json(message.payload, topic);
    require_time(presence.time);
    batch.presences.push_back(std::move(presence));
    return;
  }
  plant::Fact fact = plant::fact_from_json(message.payload, topic);
  require_time(fact.time);
  batch.facts.push_back(std::move(fact));
}

void refuse(Message message, const plant::CellName& of, Refusal why, const std::string& words,
            Batch& batch) {
  batch.refused.push_back(
      {of, printable(message.topic), std::move(message.payload), why, printable(words)});
}

}  // namespace

bool is_time(std::string_view text) {
  constexpr std::string_view kForm = "dddd-dd-ddTdd:dd:dd";
  if (text.size() <= kForm.size() || text.size() > kForm.size() + 11 || text.back() != 'Z')
    return false;
  for (std::size_t i = 0; i < kForm.size(); ++i)
    if (kForm[i] == 'd' ? !is_digit(text[i]) : text[i] != kForm[i]) return false;
  const std::string_view part = text.substr(kForm.size(), text.size() - kForm.size() - 1);
  const bool fraction = part.empty() || (part.size() > 1 && part[0] == '.' &&
                                         std::all_of(part.begin() + 1, part.end(), is_digit));
  const std::chrono::year_month_day day{
      std::chrono::year(number_at(text, 0, 4)),
      std::chrono::month(static_cast<unsigned>(number_at(text, 5, 2))),
      std::chrono::day(static_cast<unsigned>(number_at(text, 8, 2)))};
  return fraction && day.ok() && number_at(text, 0, 4) >= 1970 && number_at(text, 11, 2) < 24 &&
         number_at(text, 14, 2) < 60 && number_at(text, 17, 2) < 60;
}

void judge(Message message, Meters& meters, Meters::Time now, Batch& batch) {
  const std::optional<Topic> topic = plant::topic_of(message.topic);
  const plant::CellName of = topic ? topic->of : plant::CellName{};
  if (!meters.allows(of, message.payload.size(), now)) {
    ++batch.too_many[of];  // refused to limit the load
    return;
  }
  if (!topic || (topic->subject != Subject::kFact && topic->subject != Subject::kPresence))
    return refuse(std::move(message), of, Refusal::kTopic, "the topic is none of a cell's", batch);
  if (message.payload.size() > plant::kLargestMessage)
    return refuse(std::move(message), of, Refusal::kSize,
                  std::to_string(message.payload.size()) + " bytes, " +
                      std::to_string(plant::kLargestMessage) + " at most",
                  batch);
  try {
    read(message, *topic, batch);
  } catch (const std::exception& bad) {  // including unforeseen ones
    refuse(std::move(message), of, Refusal::kMessage, bad.what(), batch);
  }
}

}  // namespace cellcal::daemon::fleet
