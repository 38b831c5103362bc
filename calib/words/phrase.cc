#include "calib/words/phrase.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "catalogue_texts.h"

namespace cellcal::calib {

namespace {

using nlohmann::json;
using Catalogue = std::map<std::string, std::string, std::less<>>;

const std::map<std::string, Catalogue, std::less<>>& catalogues() {
  static const auto kAll = [] {
    std::map<std::string, Catalogue, std::less<>> all;
    for (const auto& [code, text] : kCatalogueTexts)
      all.emplace(code, json::parse(text).get<Catalogue>());
    return all;
  }();
  return kAll;
}

const std::string* entry(const std::string& id, const Language& language) {
  const Catalogue& catalogue = catalogues().at(language.code());
  const auto found = catalogue.find(id);
  return found == catalogue.end() ? nullptr : &found->second;
}

std::string localised(std::string number, const Language& language) {
  const std::string* mark = entry("say.decimal_mark", language);
  const std::size_t point = number.find('.');
  if (mark != nullptr && point != std::string::npos) number.replace(point, 1, *mark);
  return number;
}

/// The first letter as a capital: ASCII, and the Latin letters with accents (UTF-8 C3 A0 to C3 BE).
std::string capitalised(std::string text) {
  const bool accented =
      text.size() > 1 && text[0] == '\xC3' && text[1] >= '\xA0' && text[1] != '\xB7';
  char& first = text[accented ? 1 : 0];
  if (accented || (first >= 'a' && first <= 'z')) first = static_cast<char>(first - 0x20);
  return text;
}

/// `form`: ".2f", "C" for a phrase with a capital at its beginning, or empty.
std::string words_of(const PhraseValue& value, const std::string& form,
                     const Language& language) try {
  const std::string pattern = "{:" + form + "}";
  if (const auto* phrase = std::get_if<Phrase>(&value.value)) {
    // A name of the user's may be that of an entry of the page: "S1", "abort".
    const bool is_name = phrase->values().empty() && !phrase->id().starts_with("say.") &&
                         !phrase->id().starts_with("finding.");
    std::string text = is_name ? phrase->id() : words(*phrase, language);
    return form == "C" ? capitalised(std::move(text)) : text;
  }
  if (const auto* number = std::get_if<std::int64_t>(&value.value))
    return fmt::format(fmt::runtime(pattern), *number);
  const double number = std::get<double>(value.value);
  std::string text = fmt::format(fmt::runtime(pattern), number);
  if (std::signbit(number) && text.find('0') != std::string::npos &&
      text.find_first_of("123456789") == std::string::npos)
    text = fmt::format(fmt::runtime(pattern), 0.0);  // no "-0.0"
  return localised(std::move(text), language);
} catch (const fmt::format_error&) {
  return words_of(value, "", language);  // a phrase from elsewhere may have a value of another type
}

double number_in(const PhraseValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value.value))
    return static_cast<double>(*whole);
  const auto* number = std::get_if<double>(&value.value);
  return number == nullptr ? std::nan("") : *number;
}

/// ".3f" of `form` ".3f!limit", with the decimals that `value` and `limit` take.
std::string fixed_form(const std::string& form, const PhraseValue& value, const Phrase& phrase) {
  const std::size_t mark = form.find('!');
  if (mark == std::string::npos) return form;
  const std::string name = form.substr(mark + 1);
  const auto limit = std::ranges::find(phrase.values(), name, &PhraseValue::name);
  const int least = std::clamp(form[1] - '0', 0, 9);
  return fmt::format(".{}f", limit == phrase.values().end()
                                 ? least
                                 : decimals_apart(number_in(value), number_in(*limit), least));
}

std::string filled(const std::string& sentence, const Phrase& phrase, const Language& language) {
  std::string text;
  std::size_t at = 0;
  for (std::size_t open = 0; (open = sentence.find('{', at)) != std::string::npos;) {
    const std::size_t close = sentence.find('}', open);
    if (close == std::string::npos) break;
    const std::string place = sentence.substr(open + 1, close - open - 1);
    const std::size_t colon = place.find(':');
    const auto value =
        std::ranges::find(phrase.values(), place.substr(0, colon), &PhraseValue::name);
    text += sentence.substr(at, open - at);
    text += value == phrase.values().end()
                ? "{" + place + "}"
                : words_of(*value,
                           colon == std::string::npos
                               ? ""
                               : fixed_form(place.substr(colon + 1), *value, phrase),
                           language);
    at = close + 1;
  }
  return text + sentence.substr(at);
}

}  // namespace

std::optional<Language> Language::of(std::string_view code) {
  const auto found = catalogues().find(code.substr(0, code.find_first_of("-_.")));
  if (found == catalogues().end()) return std::nullopt;
  return Language(found->first);
}

std::vector<std::string> Language::codes() {
  std::vector<std::string> codes;
  for (const auto& [code, catalogue] : catalogues()) codes.push_back(code);
  return codes;
}

Phrase::Phrase(std::string id) : id_(std::move(id)) {}
Phrase::Phrase(const char* id) : id_(id) {}

Phrase::Phrase(std::string id, std::vector<PhraseValue> values)
    : id_(std::move(id)), values_(std::move(values)) {
  std::ranges::sort(values_, {}, &PhraseValue::name);  // as in JSON
}

bool Phrase::operator==(const Phrase&) const = default;

bool PhraseValue::operator==(const PhraseValue&) const = default;

Phrase joined(const char* separator, const Phrase& a, const Phrase& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {separator, {{"a", a}, {"b", b}}};
}

int decimals_apart(double a, double b, int least) {
  constexpr int kMost = 9;
  for (int decimals = least; decimals <= kMost; ++decimals)
    if (fmt::format("{:.{}f}", std::abs(a), decimals) !=
        fmt::format("{:.{}f}", std::abs(b), decimals))
      return decimals;
  return least;
}

std::optional<std::string> sentence_of(const std::string& id, const Language& language) {
  const std::string* found = entry(id, language);
  if (found == nullptr) return std::nullopt;
  return *found;
}

std::string words(const Phrase& phrase, const Language& language) {
  const std::string sentence = sentence_of(phrase.id(), language).value_or(phrase.id());
  return phrase.values().empty() ? sentence : filled(sentence, phrase, language);
}

}  // namespace cellcal::calib
