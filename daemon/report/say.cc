#include "daemon/report/say.h"

#include <fmt/format.h>

#include "calib/export/svg.h"

namespace cellcal::daemon::report {

namespace {

calib::Language& spoken() {
  thread_local calib::Language now;
  return now;
}

}  // namespace

Speaking::Speaking(const calib::Language& language) : before_(spoken()) { spoken() = language; }
Speaking::~Speaking() { spoken() = before_; }

const calib::Language& language() { return spoken(); }

std::string localised(std::string number) {
  const std::size_t point = number.find('.');
  if (point != std::string::npos) number.replace(point, 1, say("say.decimal_mark"));
  return number;
}

std::string say(const calib::Phrase& phrase) { return calib::words(phrase, spoken()); }

std::string counted(std::size_t count, const std::string& id) {
  return say({id + (count == 1 ? "one" : "many"), {{"n", count}}});
}

std::string unit_word(const std::string& unit) {
  const std::string id = "say.unit." + unit;
  return calib::sentence_of(id) ? say(id) : unit;
}

std::string sentence(const calib::Phrase& phrase) {
  if (phrase.empty()) return {};
  return svg::escape(say({"say.report.sentence", {{"words", phrase}}}));
}

std::string file_name(const std::string& stem, const calib::Language& language,
                      const std::string& extension) {
  return stem + (language == calib::Language() ? "" : "." + language.code()) + "." + extension;
}

std::string paragraph(std::string_view css_class, const std::string& html) {
  return css_class.empty() ? fmt::format("<p>{}</p>\n", html)
                           : fmt::format("<p class=\"{}\">{}</p>\n", css_class, html);
}

std::string table_head(std::initializer_list<Column> columns) {
  std::string cells;
  for (const Column& column : columns)
    cells += fmt::format("<th scope=\"col\"{}>{}</th>", column.is_word ? " class=\"word\"" : "",
                         column.html);
  return fmt::format("<thead><tr>{}</tr></thead>\n", cells);
}

}  // namespace cellcal::daemon::report
