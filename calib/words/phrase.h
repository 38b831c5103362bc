#pragma once
// A sentence for the user as a value: its id in the catalogues and the values in it. Words are made at the
// edge, in the reader's language. One JSON file per language is all that a language needs; the page shares it.

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cellcal::calib {

/// A language that has a catalogue; English by default.
class Language {
 public:
  Language() = default;
  /// None without a catalogue. "de-AT" gives "de".
  static std::optional<Language> of(std::string_view code);
  /// Codes in alphabetical order: "de", "en".
  static std::vector<std::string> codes();

  const std::string& code() const { return code_; }
  bool operator==(const Language&) const = default;

 private:
  explicit Language(std::string code) : code_(std::move(code)) {}

  std::string code_ = "en";
};

struct PhraseValue;

/// An id that no catalogue has, e.g. the text of a device or of a parser, is shown unchanged.
class Phrase {
 public:
  Phrase() = default;
  Phrase(std::string id);  // NOLINT: text is a phrase
  Phrase(const char* id);  // NOLINT
  Phrase(std::string id, std::vector<PhraseValue> values);

  const std::string& id() const { return id_; }
  const std::vector<PhraseValue>& values() const { return values_; }
  bool empty() const { return id_.empty(); }

  bool operator==(const Phrase&) const;

 private:
  std::string id_;
  std::vector<PhraseValue> values_;
};

/// Fills {name} or {name:.2f} of a sentence; behind the colon as in fmt, or C: with a capital. {name:.2f!limit} is
/// compared with the value `limit`: decimals_apart().
struct PhraseValue {
  template <std::integral T>
  PhraseValue(std::string its_name, T number)
      : name(std::move(its_name)), value(static_cast<std::int64_t>(number)) {}
  PhraseValue(std::string its_name, double number) : name(std::move(its_name)), value(number) {}
  PhraseValue(std::string its_name, Phrase phrase)
      : name(std::move(its_name)), value(std::move(phrase)) {}

  bool operator==(const PhraseValue&) const;

  std::string name;
  std::variant<double, std::int64_t, Phrase> value;
};

/// "a; b" with the separator's own id ("say.join.semicolon": "{a}; {b}"). Empty ones are left out.
Phrase joined(const char* separator, const Phrase& a, const Phrase& b);

/// Decimals, `least` or more, with which the absolute values differ in print; `least` if nine are not enough.
int decimals_apart(double a, double b, int least);

/// Numbers have the language's decimal mark. A value that the sentence names and the phrase lacks stays {name}.
std::string words(const Phrase& phrase, const Language& language = {});
/// The catalogue's entry without values; none: no such id.
std::optional<std::string> sentence_of(const std::string& id, const Language& language = {});

}  // namespace cellcal::calib
