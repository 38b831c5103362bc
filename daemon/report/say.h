#pragma once
// Sentences, table heads and numbers of documents, in the language of the document.

#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>

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
/// "deg", "mm" as the language writes it.
std::string unit_word(const std::string& unit);
/// Escaped, with a capital and a full stop; empty without words.
std::string sentence(const calib::Phrase& phrase);

/// "report.html"; "report.de.html" in another language than English.
std::string file_name(const std::string& stem, const calib::Language& language,
                      const std::string& extension);

/// <p class="note">...</p>; without a class where it is empty.
std::string paragraph(std::string_view css_class, const std::string& html);

struct Column {
  std::string html;
  bool is_word = false;  ///< to the left, otherwise a number
};
/// <thead> of one row.
std::string table_head(std::initializer_list<Column> columns);

}  // namespace cellcal::daemon::report
