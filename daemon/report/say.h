#pragma once
// Sentences, table heads and numbers of documents, in the language of the document.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

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

}  // namespace cellcal::daemon::report
