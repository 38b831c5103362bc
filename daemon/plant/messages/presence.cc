#include "daemon/plant/messages/presence.h"

#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

namespace {

namespace fields = calib::fields;
using fields::field;

constexpr const char* kPresenceFormat = "cellcal.presence/1";
constexpr std::size_t kLargestPresence = std::size_t{1} << 14;

const fields::Table<Presence>& presence_fields() {
  using T = Presence;
  static const fields::Table<T> kTable{field("online", &T::online, fields::flag()),
                                       field("farewell", &T::farewell, fields::flag()),
                                       field("journal", &T::journal, name()),
                                       field("number", &T::number, count<std::int64_t>()),
                                       field("software", &T::software, line()),
                                       field("time", &T::time, line()),
                                       field("mock", &T::mock, fields::flag())};
  return kTable;
}

}  // namespace

std::string to_json(const Presence& presence) {
  fields::Json json{
      {"format", kPresenceFormat}, {"plant", presence.of.plant}, {"cell", presence.of.cell}};
  json.update(fields::to_json(presence_fields(), presence));
  return json.dump(-1, ' ', false, fields::Json::error_handler_t::replace);
}

Presence presence_from_json(std::string_view json, const Topic& topic) {
  const std::string where = to_text(topic);
  const nlohmann::json parsed = json_of(json, kLargestPresence, where);
  const calib::JsonReader reader(parsed, where);
  if (reader.at("format").text() != kPresenceFormat)
    reader.at("format").fail(std::string("must be \"") + kPresenceFormat + '"');
  Presence presence;
  presence.of = {name().from(reader.at("plant")), name().from(reader.at("cell"))};
  if (presence.of != topic.of) reader.at("cell").fail("is not the topic's");
  fields::from_json(presence_fields(), reader, presence);
  return presence;
}

}  // namespace cellcal::daemon::plant
