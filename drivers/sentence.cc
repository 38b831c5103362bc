#include "drivers/sentence.h"

#include <cmath>
#include <ostream>

namespace cellcal::drivers {

Sentence::Sentence() = default;
Sentence::Sentence(std::string its_id) : id(std::move(its_id)) {}
Sentence::Sentence(const char* its_id) : id(its_id) {}
Sentence::Sentence(std::string its_id, std::vector<SentenceValue> its_values)
    : id(std::move(its_id)), values(std::move(its_values)) {}
Sentence::Sentence(const Sentence&) = default;
Sentence::Sentence(Sentence&&) noexcept = default;
Sentence& Sentence::operator=(const Sentence&) = default;
Sentence& Sentence::operator=(Sentence&&) noexcept = default;
Sentence::~Sentence() = default;
bool Sentence::operator==(const Sentence& other) const {
  return id == other.id && values == other.values;
}
bool SentenceValue::operator==(const SentenceValue& other) const {
  return name == other.name && value == other.value;
}

namespace {

Sentence joined(const char* separator, Sentence a, Sentence b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {separator, {{"a", std::move(a)}, {"b", std::move(b)}}};
}

}  // namespace

Sentence sentences(Sentence a, Sentence b) {
  return joined("say.join.sentences", std::move(a), std::move(b));
}

Sentence with_note(Sentence a, Sentence b) {
  return joined("say.join.semicolon", std::move(a), std::move(b));
}

Sentence late_bytes(double late_s, double limit_s) {
  constexpr double kMs = 1e3;
  // Rounded up, so that a value beyond its limit reads so.
  return {"say.stop.sensor_late", {{"ms", std::ceil(kMs * late_s)}, {"limit", kMs * limit_s}}};
}

std::ostream& operator<<(std::ostream& to, const Sentence& sentence) {
  to << sentence.id;
  for (const SentenceValue& one : sentence.values)
    std::visit([&](const auto& value) { to << ", " << one.name << " = " << value; }, one.value);
  return to;
}

}  // namespace cellcal::drivers
