#pragma once
// Sentences, table heads and numbers of documents, in the language of the document.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "calib/export/svg.h"
#include "calib/words/phrase.h"

namespace cellcal::daemon::report {

/// Documents that this thread makes have this language as long as the object lives: say(), and the decimal mark
/// of fixed() and its like. English without one. Objects are nested.
class Speaking {
 public:
  explicit Speaking(const calib::Language& language);
  ~Speaking();
  Speaking(const Speaking&) = delete;
  Speaking& operator=(const Speaking&) = delete;

 private:
  calib::Language before_;
};

const calib::Language& language();
/// '.' of a number as the language writes it.
std::string localised(std::string number);

/// An entry of the catalogue, which is HTML, as are values that are texts.
std::string say(const calib::Phrase& phrase);
/// say() of ID + "one" or ID + "many", with {n}: "1 touch", "12 touches".
std::string counted(std::size_t count, const std::string& id);
/// say() of IDS + NAME; `otherwise` where no catalogue has it.
std::string say_if(const std::string& ids, const std::string& name,
                   const std::string& otherwise = {});
/// "deg", "mm" as the language writes it.
std::string unit_word(const std::string& unit);
/// Escaped, with a capital and a full stop; empty without words.
std::string sentence(const calib::Phrase& phrase);

/// "report.html"; "report.de.html" in another language than English.
std::string file_name(const std::string& stem, const calib::Language& language,
                      const std::string& extension);

/// A document from its doctype to <main>, in which neither scripts nor external content are permitted. `title`, `more`
/// (further elements of the head): HTML.
std::string begin_document(const std::string& title, std::string_view style,
                           std::string_view more = {});

/// <p class="note">...</p>; without a class where it is empty.
std::string paragraph(std::string_view css_class, const std::string& html);

/// Row of a table of names and values.
std::string pair_row(const std::string& name, const std::string& html);

/// `head`: an id of the catalogue, or HTML. `css_class`: of its cells; "word": to the left, otherwise numbers.
struct Column {
  Column(const char* head, std::string css_class = {})
      : html(say(head)), css(std::move(css_class)) {}

  std::string html, css;
};
/// A table of class "numbers", in a box that scrolls.
class Table {
 public:
  /// `above`: cells of a row above the columns' heads. Without a head of the first column there is none.
  explicit Table(std::vector<Column> columns, std::string_view css_class = {},
                 std::string_view above = {});

  /// Cells as HTML; the first one is the row's head.
  void row(const std::vector<std::string>& cells, std::string_view css_class = {});
  /// A row that is one heading.
  void group(const std::string& heading);
  void next_body();
  std::string html() const;

 private:
  std::vector<Column> columns_;
  std::string head_, rows_;
};

// Formatting of texts and numbers for HTML, independent of the locale, with the document's decimal mark.

using svg::escape, svg::shorten;

/// In place of a number that is not known.
inline constexpr const char* kDash = "\xE2\x80\x93";

/// Fixed decimals, typographic minus sign, never "-0.000"; an en dash for non-finite values; scientific from
/// 1e9 on.
std::string fixed(double value, int decimals);
/// The same with an explicit plus sign.
std::string signed_fixed(double value, int decimals);
/// As fixed(), with an ASCII minus and a decimal point, for values copied into files.
std::string ascii_fixed(double value, int decimals);
/// Shortest text with this many significant digits, e.g. "0.00036", "2.1e-06".
std::string significant(double value, int digits);

/// Metres as millimetres; three decimals resolve 1 um, a thirtieth of the noise of one touch.
inline constexpr int kMmDecimals = 3;
std::string mm(double metres, int decimals = kMmDecimals);
std::string signed_mm(double metres, int decimals = kMmDecimals);

/// For values that are positive when known: an en dash for zero, negative and non-finite values, so that "not
/// computed" never reads as a perfect 0.000.
std::string positive_mm(double metres, int decimals = kMmDecimals);

/// "0.031 mm" with a non-breaking space; unescaped text.
std::string mm_words(double metres);

/// "2025-03-14 02:10:00 UTC" for ISO 8601 in UTC; other texts unchanged. Not escaped.
std::string readable_time(std::string_view iso);

}  // namespace cellcal::daemon::report
