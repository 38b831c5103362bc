#pragma once
// A sentence for the user as a value: the id of its words, and the values in it. The words are not part of the
// drivers: ids are those of the catalogues (calib/words).

#include <concepts>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace cellcal::drivers {

struct SentenceValue;

/// An id that no catalogue has is shown unchanged.
struct Sentence {
  // Defined where SentenceValue is complete.
  Sentence();
  Sentence(std::string its_id);  // NOLINT: text is a sentence
  Sentence(const char* its_id);  // NOLINT
  Sentence(std::string its_id, std::vector<SentenceValue> its_values);
  Sentence(const Sentence&);
  Sentence(Sentence&&) noexcept;
  Sentence& operator=(const Sentence&);
  Sentence& operator=(Sentence&&) noexcept;
  ~Sentence();
  bool operator==(const Sentence&) const;

  bool empty() const { return id.empty(); }

  std::string id;
  std::vector<SentenceValue> values;
};

struct SentenceValue {
  template <std::integral T>
  SentenceValue(std::string its_name, T number)
      : name(std::move(its_name)), value(static_cast<std::int64_t>(number)) {}
  SentenceValue(std::string its_name, double number) : name(std::move(its_name)), value(number) {}
  SentenceValue(std::string its_name, Sentence sentence)
      : name(std::move(its_name)), value(std::move(sentence)) {}
  bool operator==(const SentenceValue&) const;

  std::string name;
  std::variant<double, std::int64_t, Sentence> value;
};

/// "a. B" and "a; b". Empty ones are left out.
Sentence sentences(Sentence a, Sentence b);
Sentence with_note(Sentence a, Sentence b);

/// The contact sensor's bytes that this computer processed late, at a move and at rest. `late_s`: age of the
/// newest data [s]; `limit_s`: its limit.
Sentence late_bytes(double late_s, double limit_s);

/// Id and values, for tests and debuggers.
std::ostream& operator<<(std::ostream& to, const Sentence& sentence);

}  // namespace cellcal::drivers
